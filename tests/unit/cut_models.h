#pragma once
// Models that are cut by hand, for the tests of what a cut changes.

#include "model/model.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

namespace gewebe::test {

/// A model cut from another, with the maps of nodes.
struct HandCut {
  model::Model model;
  std::vector<std::uint32_t> origin, place;
};

/// Doubles some nodes and takes some springs out: most springs of a doubled node are shared out
/// between it and its copy, some stay or go with it. Copies stand behind the surface nodes.
inline HandCut hand_cut(const model::Model& model, std::size_t doubled, std::size_t removed,
                        unsigned seed) {
  std::mt19937 engine(seed);
  const auto surface = static_cast<std::uint32_t>(model::surface_count(model));
  std::vector<std::uint32_t> chosen;
  while (chosen.size() < doubled) {
    const auto node = static_cast<std::uint32_t>(engine() % surface);
    if (std::find(chosen.begin(), chosen.end(), node) == chosen.end())
      chosen.push_back(node);
  }
  std::sort(chosen.begin(), chosen.end());
  HandCut cut;
  cut.model = model;
  model::Model& after = cut.model;
  std::map<std::uint32_t, std::uint32_t> copy_of;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    cut.place.push_back(i < surface ? i : i + static_cast<std::uint32_t>(doubled));
    if (i < surface)
      cut.origin.push_back(i);
  }
  std::vector<model::Node> copies;
  for (const std::uint32_t node : chosen) {
    copy_of[node] = surface + static_cast<std::uint32_t>(copies.size());
    copies.push_back(model.nodes[node]);
    cut.origin.push_back(node);
  }
  for (std::uint32_t i = surface; i < model.nodes.size(); ++i)
    cut.origin.push_back(i);
  after.nodes.insert(after.nodes.begin() + surface, copies.begin(), copies.end());
  for (model::Node& node : after.nodes)
    if (node.central >= 0)
      node.central += static_cast<std::int32_t>(doubled);
  after.springs.clear();
  for (const model::Spring& s : model.springs) {
    const auto add = [&](std::uint32_t i, std::uint32_t j, double share) {
      model::Spring t = s;
      t.i = std::min(i, j);
      t.j = std::max(i, j);
      t.stiffness *= share;
      after.springs.push_back(t);
    };
    const double share = 0.2 + 0.6 * static_cast<double>(engine() % 1000) / 1000;
    const bool i_far = copy_of.contains(s.i), j_far = copy_of.contains(s.j);
    const std::uint32_t i = cut.place[s.i], j = cut.place[s.j];
    const std::uint32_t far_i = i_far ? copy_of[s.i] : i, far_j = j_far ? copy_of[s.j] : j;
    if (!i_far && !j_far) {
      add(i, j, 1);
    } else if (engine() % 6 == 0) { // goes with the copies, or stays
      engine() % 2 == 0 ? add(far_i, far_j, 1) : add(i, j, 1);
    } else {
      add(i, j, share);
      add(far_i, far_j, 1 - share);
    }
  }
  for (std::size_t k = 0; k < removed; ++k)
    after.springs.erase(after.springs.begin() +
                        static_cast<std::ptrdiff_t>(engine() % after.springs.size()));
  std::sort(after.springs.begin(), after.springs.end(),
            [](const model::Spring& a, const model::Spring& b) {
              return std::tuple(a.kind, a.i, a.j) < std::tuple(b.kind, b.i, b.j);
            });
  after.triangles.clear();
  after.texcoords.clear();
  after.normals.clear();
  return cut;
}

} // namespace gewebe::test
