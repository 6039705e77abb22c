#pragma once
// A scene with a bar along x, 40 mm long and 8 mm high, whose end a sphere presses down.

#include "scene/simulation.h"

#include <string>
#include <utility>

namespace gewebe::test {

class PressedBar {
public:
  PressedBar(model::Model bar, const integrator::SolidChoice& choice, bool warp, int threads)
      : model_(std::move(bar)),
        scene_(context(threads), {.warn = [](const std::string&) {}, .guard = true}) {
    scene_.add_object("bar", model_, scene::Method::ffe, {}, scene::Integration::semi_implicit,
                      choice);
    if (warp)
      scene_.apply(scene::SetWarp{0});
    scene::SetInstrument ball;
    ball.name = "ball";
    ball.shape.radius = 6;
    ball.pose.place = {36, 4, 15};
    scene_.apply(ball);
    scene_.step(0.01);
  }
  /// Moves the sphere to this height.
  void press(double z) {
    scene_.apply(scene::MoveInstrument{0, {36, 4, z}, {}, 0});
    scene_.step(0.01);
  }
  const model::Model& model() const { return model_; }
  scene::Simulation& scene() { return scene_; }
  const scene::Simulation& scene() const { return scene_; }

private:
  static Context context(int threads) {
    Context context;
    context.threads = threads;
    return context;
  }

  model::Model model_;
  scene::Simulation scene_;
};

} // namespace gewebe::test
