#pragma once
// A solid of tetrahedra in time: corotational or stable Neo-Hookean elements (fem/corotational.h,
// fem/hyperelastic.h), lumped masses, implicit.
//
// Backward Euler: the places x' at the end of a step of h make
//
//   1/2 h² Σ m |x' - x - h v|² + Ψ(x') + D(x', x) - f · x'   least,   v' = (x' - x)/h
//
// (Hairer, Lubich, Wanner, Geometric numerical integration, 2006; as a minimum: Martin,
// Thomaszewski, Grinspun, Gross, Example-based elastic materials, 2011), Ψ the energy of the
// elements, D what damping takes: stable at any h, first order, and what a step doesn't resolve is
// damped. The minimum is sought downhill in this function alone, so that a body that was turned
// inside out finds back, whatever the tolerance is.
//
// Steps of second order are two such steps of gamma h (numeric/two_stages.h): the second one counts
// inertia, damping and friction from places, speeds and strains extrapolated from the first one,
// and starts where the first one ended, which does not intersect. Energy may grow in an impact that
// is not resolved, by up to about a tenth. Then speeds that neither move nor turn a body as a whole
// are lowered, so that momentum stays; where that does not suffice in an island, the first stage
// stays and the rest of the step is one of backward Euler (contact/island.cpp).
//
// The quick way is a quasi-Newton method with a constant matrix (Liu, Bouaziz, Kavan, Quasi-Newton
// methods for real-time simulation of hyperelastic materials, ACM TOG 36(3), 2017). The matrix is A
// = M (1/h² + drag/h) + (1 + damping/h) K at rest, factored once for each length of step and set of
// held axes (linalg/single_factor.h). It is applied in frames that turn with each node (Müller,
// Dorsey, McMillan, Jagnow, Cutler, Stable real-time deformations, 2002). L-BFGS improves it; its
// secants are in these frames too, so those of earlier steps remain valid. A step starts from an
// extrapolation of the last steps. The factor is of all three axes: one by components (n × n, as
// projective dynamics has) is a ninth of the size but knows no bending. Errors of a step of 1/60 s
// against the converged one, over its displacement, a beam 100 × 25 × 25 mm of 52,728 tetrahedra,
// held at an end, falling under its weight, nu = 0.45, E = 50 kPa: 4 rounds by components 100 % on
// average (the error of earlier steps counts), 2 rounds with this factor 9 %; with E = 5 kPa 0.6 %.
// With the default tolerance it is below 0.6 % in each step, in 1.9 rounds (2.7 without what
// earlier steps knew). The reference way factors the tangent at the body's position, again as it
// moves.
//
// If more than a hundredth of a body's volume is inside out, the body moves without Poisson's ratio
// and without damping by the stiffness until all of its elements are right side out again
// (integrator/motion_recovery_internal.h; not beside springs, nor by the reference way). 10,000
// scrambled corotational bodies of up to 162 linear elements, 1,000 of quadratic ones, 1,000 linear
// Neo-Hookean ones and 200 of quadratic elements all got there (tests/stress/scrambled.cpp). They
// may stay wound up, in a minimum of their own with every element right side out: 255 of the first,
// a quarter of quadratic ones.
//
// A step of infinite length is statics: the same minimum without inertia and damping. Hyperelastic
// elements get there by Newton's method with pressures as unknowns (fem/mixed_solid.h): near
// nu = 1/2 rounds on displacements alone are cut to an eighth, because volumes change to second
// order. Other elements, and steps in parts, by rounds of the constant matrix while they are few,
// then by tangents, each for several rounds with secants on top.
//
// Springs may move along with the elements: those of nets that are tied to a solid, and the ties.
// The constant matrix has their stiffness along every axis, which bounds them however they turn: of
// springs alone, held by whole nodes, it is one of nodes that serves each axis.
//
// Viscoelastic elements (viscous/solid_memory.h) have another energy in each step, so that the same
// minimum is sought. The energies reported are those stored. A body that finds back
// remembers nothing new meanwhile.
//
// Damping is Rayleigh's: `drag` (1/s) by masses, `damping` (s) by the stiffness, but in the
// elements' own frames, so that rotations aren't slowed down.
//
// Units: mm, g, s, Pa; forces g mm/s². The same bytes on any number of threads and CPU level.

#include "base/context.h"
#include "fem/assembly.h"
#include "numeric/two_stages.h"
#include "tetrahedra/tet_mesh.h"
#include "viscous/solid_memory.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::integrator {

/// Small strains in frames that rotate; or the hyperelastic law of each material, stable
/// Neo-Hookean unless it is said otherwise, never the classical one.
enum class SolidLaw { corotational, hyperelastic };

struct SolidMotionOptions {
  SolidLaw law = SolidLaw::corotational;
  double drag = 0;    ///< per mass, 1/s
  double damping = 0; ///< per stiffness, s
  /// A round that is expected to leave less than this part of the step's whole displacement is the
  /// last one; where axes are held, a step counts as 1e-5 of the body's displacement at least.
  double tolerance = 0.005;
  int max_rounds = 32;    ///< of the quick way
  bool reference = false; ///< Newton's method until rounding; no limit of time
  bool recover = true;    ///< scrambled bodies find back; else they move by the law alone
};

/// A spring between two nodes, with a damper along it.
struct SolidSpring {
  std::uint32_t i = 0, j = 0;
  double stiffness = 0, damping = 0; ///< g/s², g/s
  double rest = 0;                   ///< mm
};

/// What moves along with the elements: springs, and nodes of their own.
struct SolidNet {
  std::span<const SolidSpring> springs{};
  /// By node, with what hangs there; those in tetrahedra have the mass of these at least.
  std::span<const double> masses{};
  std::span<const double> drag{}; ///< by node, per mass, 1/s, in place of the options'; or none
  /// A closed surface, counter-clockwise from outside, whose parts keep their volumes, and the bulk
  /// modulus of what fills them, Pa; none: there is no such surface.
  std::span<const Triangle> enclosing{};
  double bulk = 0;
};

/// A force that follows nodes: factor (b - a) x (c - a) of the places of a triangle, as of a
/// pressure of 6 times the factor that acts on a third of it.
struct FollowingForce {
  std::uint32_t node = 0; ///< that it acts on, of the triangle
  Triangle triangle{};
  double factor = 0; ///< Pa
};

/// What is said of how a solid moves; SolidMotionOptions has the rest.
struct SolidChoice {
  std::optional<SolidLaw> law;
  std::optional<double> damping;   ///< per stiffness, s
  std::optional<double> tolerance; ///< of a step: it takes as many rounds as this needs
  std::optional<double> bulk;      ///< of what fills a net, Pa

  /// Of what a net has not.
  bool said() const { return law || damping || tolerance; }
  bool operator==(const SolidChoice&) const = default;
};

/// What a step took.
struct SolidStep {
  int rounds = 0;      ///< solutions with a factor
  int evaluations = 0; ///< of energy and forces
  double change = 0;   ///< of the last round, over the displacement
  /// What it is expected to leave, over the displacement: > tolerance, if rounds ran out.
  double left = 0;
  int factorisations = 0; ///< made for this step
  bool limited = false;   ///< speeds were lowered, see SolidMotion::step
};

/// What a step of second order has come to, g mm²/s².
struct StageEnergy {
  double gain = 0;  ///< of energy, beyond the work of the load
  double inner = 0; ///< energy of the speeds that neither move nor turn the body as a whole
  double scale = 0; ///< of energies, for rounding
};

/// Damping per stiffness that lets a motion of this frequency (Hz) decay by `ratio` of the critical
/// one. \pre frequency > 0, ratio >= 0
double damping_per_stiffness(double ratio, double frequency);

class SolidMotion {
public:
  /// At rest, nothing held. \pre check_mesh(mesh) passes, each node is in a tetrahedron or, with a
  /// mass, in the net; ends of springs are nodes
  /// \throw Error as solid_elements and MotionVolumes; if an option is out of its range, or a node
  /// has no mass
  SolidMotion(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
              const SolidMotionOptions& options, const Context& context = {});
  SolidMotion(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
              const SolidNet& net, const SolidMotionOptions& options, const Context& context = {});
  ~SolidMotion();
  SolidMotion(SolidMotion&&) noexcept;
  SolidMotion& operator=(SolidMotion&&) noexcept;

  /// Forces on the 3 n axes from now on, which keep their direction. \pre 3 n, finite
  void set_load(std::span<const double> forces);
  /// The axes held from now on; they stay where they are. \pre 3 n flags
  void hold(std::span<const std::uint8_t> held);
  /// Where held axes stand at the end of the next step, which moves them there: displacements on
  /// the 3 n axes, read where they are held.
  void move_held(std::span<const double> displacement);

  /// Forces beside the load in settle() from now on. \pre the law is hyperelastic, or there are
  /// none
  void follow(std::vector<FollowingForce> forces);
  /// To rest under the load, held axes where they are moved to: the step of infinite length, which
  /// has no inertia and no damping, downhill from here. It ends where what is left is within the
  /// tolerance, of the displacement from rest, or `left` says more. It doesn't depend on steps
  /// before. \throw NotPositiveDefinite if what is held leaves the body free to move; as Factor;
  /// Cancelled
  /// \param elapsed  s, in which a viscoelastic body comes there; else it is sudden
  SolidStep settle(const Context& context, double elapsed = 0);
  /// Lower estimate of the condition of the stiffness at rest with what is held now, 1e12 or more
  /// if the body is free to move. \throw as settle
  double condition(const Context& context);

  /// On by h seconds. Where nothing is held and moved during the step, energy (of motion, of
  /// elements and of the load) doesn't grow: what the nonlinearity or unfinished rounds would add
  /// is taken from the speeds, at last from those of the body as a whole. A body that is held
  /// nowhere changes its momentum by the load alone, and keeps its angular momentum to first order
  /// in h.
  /// \pre h > 0 \throw Error if the state is no longer finite, or as Factor; Cancelled
  /// \param stage  of a step of second order: the first one is a step of h, whose load and targets
  /// are those of its end. The second one, of the same h, goes on by (1 + sqrt 2) h and makes of
  /// both a step of second order, over which energy is watched. \pre a second one:
  /// has_first_stage(h)
  SolidStep step(double h, const Context& context, numeric::Stage stage = numeric::Stage::whole);
  /// Whether the last step was a first stage of h that a second one may follow: not where it went
  /// by recovery.
  bool has_first_stage(double h) const noexcept;

  std::span<const double> places() const noexcept;   ///< of nodes, 3 n, mm
  std::vector<double> displacement() const;          ///< 3 n, mm
  std::span<const double> velocity() const noexcept; ///< 3 n
  /// Another state. \pre 3 n each, finite
  /// A viscoelastic body remembers that it has come there suddenly.
  void set_state(std::span<const double> displacement, std::span<const double> velocity,
                 const Context& context = {});
  /// As set_state, with the places of nodes, as places() and velocity() returned them: equal to the
  /// bit. \param elapsed  as of settle()
  void restore(std::span<const double> places, std::span<const double> velocity,
               const Context& context = {}, double elapsed = 0);
  /// What a viscoelastic body remembers.
  viscous::MemoryState memory() const;
  /// As if it had come where it is by this, until it is moved. \pre memory() of such a body
  void set_memory(const viscous::MemoryState& memory);
  /// Whether it is viscoelastic and the last step changed its memory.
  bool fades() const noexcept;
  /// What earlier steps leave to the next ones, beside places and velocities: secants,
  /// accelerations, strains that damping counts from, whether a tangent serves on. Copies share it.
  struct Past;
  std::shared_ptr<const Past> past() const;
  /// Goes back: the next steps are, to the bit, those that followed past(). Factors that have
  /// changed since are made again. \param places, velocity, held  of that time \throw as Factor
  void restore(std::span<const double> places, std::span<const double> velocity,
               std::span<const std::uint8_t> held, const Past& past, const Context& context);
  /// From now on reactions() are those of the state as it stands still, until the next step.
  void find_reactions(const Context& context = {});

  // A step in parts, for a caller that adds forces which depend on positions (lib/contact).
  //
  // The iterate is a position of all nodes. A part of the step builds the quadratic model
  // 1/2 (x - x_free)^T A (x - x_free) of the step's energy around the iterate, with the constant
  // matrix A in the frames of the iterate, or the tangent there; the caller finds the forces f that
  // act at x = x_free + A^-1 f, moves there, and checks whether the model holds there. Where it
  // does, each round lowers the energy of all that takes part (majorisation and minimisation:
  // Hunter, Lange, A tutorial on MM algorithms, The American Statistician 58(1), 2004).

  /// Begins a step of h, which may be infinite (see settle); the iterate is the present position.
  /// An open step is abandoned without a trace. \pre h > 0, set_load and move_held were called for
  /// this step \throw as step
  /// \param elapsed  as of settle(), of an infinite h
  /// \param stage  as of step(); a second one that is abandoned leaves the first one, as a step
  void begin_step(double h, const Context& context, double elapsed = 0,
                  numeric::Stage stage = numeric::Stage::whole);
  /// Builds the model around the iterate, at first around where the motion leads.
  /// \param forces  f_0 that act beside the load, 3 n
  /// \param step  becomes x_free + A^-1 f_0 minus the iterate, 3 n; on held axes the way to their
  /// targets
  void linearise_step(std::span<double> step, std::span<const double> forces,
                      const Context& context);
  /// Responses of the model to unit forces on the three axes of each of these nodes, in the frame
  /// of each node: three columns of 3 n numbers a node. They are the same until matrix_version()
  /// changes. Costs less a node the more there are, up to 8.
  void unit_responses(std::span<const std::uint32_t> nodes, std::span<double> columns) const;
  std::uint64_t matrix_version() const noexcept;
  /// Factor of these responses in the present round, at most 1: less where the matrix is too soft.
  double relaxation() const noexcept;
  /// Rotation of a node's frame in the model, row-major.
  std::array<double, 9> frame_of(std::uint32_t node) const;
  /// Moves the iterate, from where it was linearised, by (1 - share) step + A^-1 (f - f_0).
  /// \param change  f - f_0, 3 n
  void move_iterate(double share, std::span<const double> change, const Context& context);
  /// Whether the energy at the iterate is that of the model, within half of the model's quadratic
  /// part. If not, the next model is of the tangent, or stiffer. The present one stays until it is
  /// built. \param forces f, 3 n
  bool model_holds(std::span<const double> forces, const Context& context);
  /// Models of this step are of the tangent from now on, where there is one.
  void sharpen();
  /// Whether the last model of the open step was of a tangent.
  bool is_sharp() const noexcept;
  /// Translates the iterate of a body that is held nowhere so that its momentum is that of load and
  /// forces, where that takes at most `room` mm: the constant matrix does not move a strained body
  /// exactly as its forces would. At rest it moves to where forces balance. \param forces f, 3 n
  /// \return whether the momentum is right, or forces balance within 3e-5 of the displacement
  bool keep_momentum(std::span<const double> forces, double room, const Context& context);
  /// Moves the iterate to where the step ends under the load alone, as step() finds it.
  void solve_alone(const Context& context);
  /// The iterate is where the step began, once more.
  void begin_iterate_again();
  std::span<const double> iterate() const noexcept; ///< 3 n
  /// Whether the open step moves held axes.
  bool moves_held() const noexcept;
  /// By how much the energy at the end of an open second stage would be more than at the beginning
  /// of the first one, with what the load has done. Nothing where held axes are moved.
  StageEnergy stage_energy(const Context& context);
  /// Ends the step at the iterate. \param forces  that act there, 3 n \param inner  factor of the
  /// speeds that neither move nor turn the body as a whole
  SolidStep end_step(std::span<const double> forces, const Context& context, double inner = 1);

  /// Whether it was scrambled, and has not found back yet.
  bool recovering() const noexcept;
  double kinetic_energy() const;   ///< g mm²/s²
  double elastic_energy() const;   ///< of the state
  double potential_energy() const; ///< elastic, and that of the load, 0 at rest
  /// What the holders push with on held axes in the last step, 0 elsewhere.
  std::span<const double> reactions() const noexcept;
  std::span<const double> masses() const noexcept; ///< by node

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::integrator
