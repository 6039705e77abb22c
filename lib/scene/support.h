#pragma once
// Table of features that a kind of object does not support. Pairs that are not listed are
// supported.

#include <array>
#include <cstdint>
#include <string_view>

namespace gewebe::scene {

/// Trait of an object. It may have several: cut and elastostatic, attached and implicit.
enum class Way : std::uint8_t {
  explicit_motion,
  implicit_motion,
  attached,
  elastostatic,
  two_step,
  two_step_stored, ///< two_step whose second stage has a stored stiffness, but no model
  whole,
  cut,
  solid,        ///< with tetrahedra
  sprung,       ///< a solid with springs or central nodes beside its tetrahedra
  net,          ///< without tetrahedra
  solid_motion, ///< an elastodynamic solid
  warped,       ///< with large rotations
  strained,     ///< elastostatic, with large strains
  filled,       ///< a net that keeps the volume it encloses
  viscoelastic  ///< a solid that relaxes
};
inline constexpr std::array all_ways{
    Way::explicit_motion, Way::implicit_motion, Way::attached, Way::elastostatic,
    Way::two_step,        Way::two_step_stored, Way::whole,    Way::cut,
    Way::solid,           Way::sprung,          Way::net,      Way::solid_motion,
    Way::warped,          Way::strained,        Way::filled,   Way::viscoelastic};

/// Feature: an action on an object.
enum class Feature : std::uint8_t {
  force,
  pressure,
  displace,
  grasp,
  touch, ///< by an instrument that pushes
  cut,   ///< by the command
  blade,
  tear, ///< by strain, or stress
  restore,
  attach,
  method, ///< change of the method
  two_step,
  warp,         ///< large rotations
  prepare,      ///< advance computation for contacts and cuts
  contact,      ///< with another object's surface
  self_contact, ///< of its surface with itself
};
inline constexpr std::array all_features{
    Feature::force,   Feature::pressure, Feature::displace, Feature::grasp,
    Feature::touch,   Feature::cut,      Feature::blade,    Feature::tear,
    Feature::restore, Feature::attach,   Feature::method,   Feature::two_step,
    Feature::warp,    Feature::prepare,  Feature::contact,  Feature::self_contact};

/// An unsupported pair of trait and feature.
struct Gap {
  Way way{};
  Feature feature{};
  bool refused = true;   ///< the command fails; else it skips the object, with one warning
  std::string_view text; ///< after "object NAME "; '*' stands for the object that it is attached to
};

inline constexpr std::array gaps{
    Gap{Way::two_step_stored, Feature::cut, true,
        "has a second stage of its store, expected two-step with the model of that, stage=FILE"},
    Gap{Way::two_step_stored, Feature::blade, false,
        "has a second stage of its store and not its model: it is not cut"},
    Gap{Way::two_step_stored, Feature::tear, false,
        "has a second stage of its store and not its model: it does not tear"},
    Gap{Way::sprung, Feature::cut, true,
        "has springs beside its tetrahedra, expected tetrahedra alone to cut"},
    Gap{Way::sprung, Feature::blade, false, "has springs beside its tetrahedra: it is not cut"},
    Gap{Way::sprung, Feature::tear, false, "has springs beside its tetrahedra: it does not tear"},
    Gap{Way::filled, Feature::cut, true,
        "keeps the volume it encloses (bulk=), expected none to cut"},
    Gap{Way::filled, Feature::blade, false, "keeps the volume it encloses (bulk=): it is not cut"},
    Gap{Way::filled, Feature::tear, false,
        "keeps the volume it encloses (bulk=): it does not tear"},
    Gap{Way::filled, Feature::attach, true,
        "keeps the volume it encloses (bulk=), expected none to attach"},
    Gap{Way::filled, Feature::method, true,
        "keeps the volume it encloses (bulk=) as long as it moves, expected none for method"},
    Gap{Way::viscoelastic, Feature::cut, true,
        "is viscoelastic (prony:), expected an elastic one to cut"},
    Gap{Way::viscoelastic, Feature::blade, false, "is viscoelastic (prony:): it is not cut"},
    Gap{Way::viscoelastic, Feature::tear, false, "is viscoelastic (prony:): it does not tear"},
    Gap{Way::viscoelastic, Feature::attach, true,
        "is viscoelastic (prony:), expected an elastic one to attach"},
    Gap{Way::viscoelastic, Feature::method, true,
        "is viscoelastic (prony:) and would forget, expected an elastic one for method"},
    Gap{Way::elastostatic, Feature::attach, true,
        "is elastostatic (ffe) and has no motion to tie, expected ela objects"},
    Gap{Way::explicit_motion, Feature::two_step, true,
        "is elastodynamic (ela), expected an elastostatic one for two-step"},
    Gap{Way::implicit_motion, Feature::two_step, true,
        "is elastodynamic (ela), expected an elastostatic one for two-step"},
    Gap{Way::warped, Feature::two_step, true,
        "has large rotations (rotation=warp), expected one without for two-step"},
    Gap{Way::strained, Feature::two_step, true,
        "has large strains (law=), expected one without for two-step"},
    Gap{Way::strained, Feature::warp, true,
        "has large strains (law=), expected one without for rotation=warp"},
    Gap{Way::explicit_motion, Feature::warp, true,
        "is elastodynamic (ela), expected an elastostatic one for rotation=warp"},
    Gap{Way::implicit_motion, Feature::warp, true,
        "is elastodynamic (ela), expected an elastostatic one for rotation=warp"},
    Gap{Way::explicit_motion, Feature::prepare, true,
        "is elastodynamic (ela), expected an elastostatic one for prepare"},
    Gap{Way::implicit_motion, Feature::prepare, true,
        "is elastodynamic (ela), expected an elastostatic one for prepare"},
    Gap{Way::two_step, Feature::warp, true,
        "goes on by two steps, expected none for rotation=warp"},
    Gap{Way::net, Feature::warp, true, "has no tetrahedra, expected a solid for rotation=warp"},
    Gap{Way::cut, Feature::two_step, true,
        "is cut and its second stage is not, expected one that is whole"},
    Gap{Way::whole, Feature::restore, true, "is as it came, expected one that was cut"},
    Gap{Way::attached, Feature::method, true,
        "is attached to * and moves with it, expected one that is attached to none"},
};

/// Entry of a pair; null: the pair is supported.
constexpr const Gap* gap(Way way, Feature feature) {
  for (const Gap& one : gaps)
    if (one.way == way && one.feature == feature)
      return &one;
  return nullptr;
}

} // namespace gewebe::scene
