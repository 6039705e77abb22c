// Elastodynamics: time of a stretch of motion against error, beside Taichi in single and double
// precision where $PYTHON (python3) has it, and the speed of the springs against a plain loop over
// an edge list and against what root and division alone allow.

#include "dynamics/elastodynamic.h"
#include "model/build.h"
#include "model/primitive.h"
#include "peer.h"
#include "tests/unit/larger.h"
#include "timing.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <immintrin.h>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

using namespace gewebe;
using timing::Times;

void print(const std::string& stage, const char* program, std::size_t springs, double steps,
           int threads, const Times& t, double error) {
  std::printf("%s,%s,%zu,%.0f,%d,%.3f,%.3f,%.3f,%.3g,largest error over largest displacement\n",
              stage.c_str(), program, springs, steps, threads, t.median, t.fastest, t.slowest,
              error);
  std::fprintf(stderr, "%s, %s, %d threads: %.0f steps/s, %.1f M springs/s\n", stage.c_str(),
               program, threads, steps / t.median * 1e3,
               static_cast<double>(springs) * steps / t.median / 1e3);
}

contact::Load push(const model::Model& model) {
  contact::Load load{.gravity = {0, 0, -9810}};
  load.force[static_cast<std::uint32_t>(model::surface_count(model) / 2)] = {500, 0, 0};
  return load;
}

/// What one would write first.
class PlainLoop {
public:
  explicit PlainLoop(const model::Model& model) : model_(model) {
    for (const model::Node& n : model.nodes)
      points_.push_back({n.position, {}, {}, n.mass, n.drag, n.fixed == model::fixed_all});
    load_ = push(model);
  }

  void step(double h) {
    for (Point& p : points_)
      p.force = p.mass * load_.gravity - p.drag * p.v;
    for (const auto& [node, force] : load_.force)
      points_[node].force += force;
    for (const model::Spring& s : model_.springs) {
      Point &i = points_[s.i], &j = points_[s.j];
      const Vec3 d = j.x - i.x;
      const double l = norm(d);
      const Vec3 n = d / l;
      const Vec3 f = (s.stiffness * (l - s.rest) + s.damping * dot(j.v - i.v, n)) * n;
      i.force += f;
      j.force -= f;
    }
    for (Point& p : points_)
      if (!p.fixed) {
        p.v += h / p.mass * p.force;
        p.x += h * p.v;
      }
  }

  Vec3 displacement(std::size_t i) const { return points_[i].x - model_.nodes[i].position; }

private:
  struct Point {
    Vec3 x, v, force;
    double mass, drag;
    bool fixed;
  };
  const model::Model& model_;
  contact::Load load_;
  std::vector<Point> points_;
};

std::vector<Vec3> moved(const dynamics::Elastodynamic& object) {
  std::vector<Vec3> u;
  for (const dynamics::NodeMotion& m : object.motion())
    u.push_back(m.displacement);
  return u;
}

double difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double error = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double e = norm(a[i] - b[i]);
    error = test::larger(error, e);
    size = test::larger(size, norm(b[i]));
  }
  return error / size;
}

std::vector<Vec3> run(const model::Model& model, double duration, double h,
                      const Context& context) {
  dynamics::Elastodynamic object(model);
  object.set_load(push(model));
  (void)object.advance(duration, h, context);
  return moved(object);
}

[[gnu::target("avx2")]] void roots_and_divisions_avx2(const double* square, double* inverse,
                                                      std::size_t count) {
  const __m256d one = _mm256_set1_pd(1);
  for (std::size_t k = 0; k < count; k += 4) {
    const __m256d x = _mm256_loadu_pd(square + k);
    _mm256_storeu_pd(inverse + k, _mm256_mul_pd(_mm256_div_pd(one, x), _mm256_sqrt_pd(x)));
  }
}

void roots_and_divisions_sse2(const double* square, double* inverse, std::size_t count) {
  const __m128d one = _mm_set1_pd(1);
  for (std::size_t k = 0; k < count; k += 2) {
    const __m128d x = _mm_loadu_pd(square + k);
    _mm_storeu_pd(inverse + k, _mm_mul_pd(_mm_div_pd(one, x), _mm_sqrt_pd(x)));
  }
}

/// Root and division of every spring, and nothing else, four at a time where the processor can.
double limit(std::size_t springs, double steps) {
  auto* const work =
      __builtin_cpu_supports("avx2") ? roots_and_divisions_avx2 : roots_and_divisions_sse2;
  std::vector<double> square(1024, 2), inverse(1024);
  double sum = 0;
  const auto rounds = static_cast<std::size_t>(static_cast<double>(springs) * steps / 1024);
  const double time = timing::milliseconds([&] {
    for (std::size_t r = 0; r < rounds; ++r) {
      work(square.data(), inverse.data(), square.size());
      sum += inverse[r % inverse.size()];
    }
  });
  return sum > 0 ? time : 0;
}

/// The same net in Taichi; false where there is none.
bool taichi(const model::Model& model, double h, int steps, int threads, const char* precision,
            Times& times, std::vector<Vec3>& u) {
  constexpr int runs = 3;
  const std::string path =
      (std::filesystem::temp_directory_path() / ("ela-" + std::to_string(getpid()))).string();
  const contact::Load load = push(model);
  std::vector<double> numbers;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    const model::Node& n = model.nodes[i];
    const auto force = load.force.find(i);
    const Vec3 outer = n.mass * load.gravity + (force != load.force.end() ? force->second : Vec3{});
    numbers.insert(numbers.end(),
                   {n.position.x, n.position.y, n.position.z, n.mass, n.drag, outer.x, outer.y,
                    outer.z, n.fixed == model::fixed_all ? 0.0 : 1.0});
  }
  for (const model::Spring& s : model.springs)
    numbers.insert(numbers.end(), {1.0 * s.i, 1.0 * s.j, s.stiffness, s.damping, s.rest});
  {
    const std::uint64_t counts[2] = {model.nodes.size(), model.springs.size()};
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(counts), sizeof counts);
    file.write(reinterpret_cast<const char*>(numbers.data()),
               static_cast<std::streamsize>(numbers.size() * sizeof(double)));
  }
  char call[512];
  (void)std::snprintf(call, sizeof call, "tests/bench/ela_taichi.py '%s' %.17g %d %d %d %s",
                      path.c_str(), h, steps, threads, runs, precision);
  const std::vector<double> found = timing::numbers_of_script(call);
  const bool made = found.size() == static_cast<std::size_t>(runs);
  if (made) {
    times = timing::times_of(found);
    u.resize(model.nodes.size());
    std::ifstream file(path, std::ios::binary);
    file.read(reinterpret_cast<char*>(u.data()),
              static_cast<std::streamsize>(u.size() * sizeof(Vec3)));
  }
  std::filesystem::remove(path);
  return made;
}

void speed(const model::Model& model, double steps) {
  const std::string stage = "speed " + std::to_string(model.nodes.size()) + " nodes";
  const double h = 0.9 * model::safe_step(model);
  constexpr int runs = 7;
  std::vector<Vec3> plain_u;
  std::vector<double> plain_times;
  for (int run = 0; run < runs; ++run) {
    PlainLoop loop(model);
    plain_times.push_back(timing::milliseconds([&] {
      for (int s = 0; s < static_cast<int>(steps); ++s)
        loop.step(h);
    }));
    plain_u.clear();
    for (std::size_t i = 0; i < model.nodes.size(); ++i)
      plain_u.push_back(loop.displacement(i));
  }
  const Times plain = timing::times_of(plain_times);
  const double allowed = limit(model.springs.size(), steps);
  print(stage, "root and division alone", model.springs.size(), steps, 1,
        {allowed, allowed, allowed}, 0);
  for (const int threads : {1, 2}) {
    dynamics::Elastodynamic object(model);
    std::vector<Vec3> u;
    std::vector<double> times;
    for (int run = 0; run < runs; ++run) {
      object.set_motion(std::vector<dynamics::NodeMotion>(model.nodes.size()));
      object.set_load(push(model));
      times.push_back(timing::milliseconds(
          [&] { (void)object.advance(steps * h, h, timing::with_threads(threads)); }));
      u = moved(object);
    }
    print(stage, "gewebe", model.springs.size(), steps, threads, timing::times_of(times),
          difference(u, plain_u));
  }
  print(stage, "plain loop", model.springs.size(), steps, 1, plain, 0);
  for (const int threads : {1, 2}) {
    Times t{};
    std::vector<Vec3> u;
    if (taichi(model, h, static_cast<int>(steps), threads, "f64", t, u))
      print(stage, "Taichi f64", model.springs.size(), steps, threads, t, difference(u, plain_u));
  }
}

void work_precision(const model::Model& model) {
  const double safe = model::safe_step(model), duration = 400 * safe;
  const Context one = timing::with_threads(1);
  const std::vector<Vec3> exact = run(model, duration, safe / 64, one);
  const std::string stage = "motion " + std::to_string(model.nodes.size()) + " nodes";
  for (const double part : {0.9, 0.45, 0.225, 0.1125}) {
    std::vector<Vec3> u;
    const Times t = timing::measure([&] { u = run(model, duration, part * safe, one); }, 3);
    print(stage, "semi-implicit", model.springs.size(), 400 / part, 1, t, difference(u, exact));
  }
  for (const char* precision : {"f64", "f32"})
    for (const double part : {0.9, 0.45, 0.225, 0.1125}) {
      const double steps = std::ceil(400 / part * (1 - 1e-12));
      Times t{};
      std::vector<Vec3> u;
      if (!taichi(model, duration / steps, static_cast<int>(steps), 1, precision, t, u)) {
        (void)std::fputs("ela: Taichi skipped, python3 has none\n", stderr);
        return;
      }
      print(stage, (std::string("Taichi ") + precision).c_str(), model.springs.size(), steps, 1, t,
            difference(u, exact));
    }
}

void sleeping(const model::Model& model) {
  dynamics::Elastodynamic object(model);
  const double h = 0.9 * model::safe_step(model);
  constexpr int calls = 100000;
  const double time = timing::milliseconds([&] {
    for (int k = 0; k < calls; ++k)
      (void)object.advance(0.01, h, Context{});
  });
  std::fprintf(stderr, "asleep: %.4f us a step\n", time * 1e3 / calls);
}

} // namespace

int main() {
  std::puts("stage,program,springs,steps,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  const auto sphere = [](const char* text) {
    return model::build_model(model::primitive_mesh(model::parse_primitive(text, "60")), {},
                              Context{})
        .model;
  };
  const model::Model organ = sphere("sphere:100x100");
  speed(organ, 300);
  speed(sphere("sphere:316x316"), 20);
  sleeping(organ);
  work_precision(sphere("sphere:40x40"));
}
