#pragma once
// What a linear object answered before: an orthonormal basis of the questions asked so far, with
// the answer to each. A grasp that moves rigidly asks within twelve dimensions (the entries of its
// turn and its shift), so that its cost does not depend on how many nodes it holds.

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe {

class ShapeModes {
public:
  /// Most modes that pay: those of a rigid grasp, and some for a load beside it and for rounding.
  static constexpr std::size_t max_questions = 16;

  void clear();
  /// Whether a question outside the span may still be added.
  bool open() const noexcept { return questions_.size() < max_questions && !given_up_; }
  std::size_t size() const noexcept { return questions_.size(); }

  /// The coefficients of `question` in the basis, and in `rest` what is outside its span.
  /// \return whether that is nothing, up to rounding (1e-11 of the question)
  bool express(std::span<const double> question, std::vector<double>& coefficients,
               std::vector<double>& rest) const;
  /// One more mode. \param question outside the span (a `rest`), of length 1 \param answer of its
  /// own
  void add(std::vector<double> question, std::vector<double> answer);
  /// Questions go everywhere: no mode is added any more, and those there are make room.
  void give_up();

  /// answer += Σ coefficients[k] answer k.
  void answer(std::span<const double> coefficients, std::span<double> answer) const;

private:
  std::vector<std::vector<double>> questions_, answers_;
  bool given_up_ = false;
};

} // namespace gewebe
