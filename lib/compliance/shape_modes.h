#pragma once
// Cache of responses of a linear object: an orthonormal basis of the inputs ("questions") so far,
// with the output ("answer") for each. The inputs of a grasp that moves rigidly have twelve
// dimensions (the entries of its rotation and its translation), so that its cost does not depend on
// the number of nodes.

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::compliance {

/// Basis of inputs and their outputs. A copy shares both.
class ShapeModes {
public:
  /// Largest number of modes: those of a rigid grasp, and some for other loads and for rounding.
  static constexpr std::size_t max_questions = 16;

  void clear();
  /// Whether a question outside the span may still be added.
  bool open() const noexcept { return questions_.size() < max_questions && !given_up_; }
  std::size_t size() const noexcept { return questions_.size(); }

  /// Finds the coefficients of `question` in the basis, and its part outside the span, `rest`.
  /// \return whether `rest` is zero up to rounding (1e-11 of the question)
  bool express(std::span<const double> question, std::vector<double>& coefficients,
               std::vector<double>& rest) const;
  /// Adds a mode.
  /// \param question  outside the span (a `rest`), of length 1
  /// \param answer  for this question
  void add(std::vector<double> question, std::vector<double> answer);
  /// To be called if questions have no common subspace: frees all modes and accepts no more.
  void give_up();

  /// answer += Σ coefficients[k] times the answer of mode k.
  void answer(std::span<const double> coefficients, std::span<double> answer) const;

private:
  std::vector<std::shared_ptr<const std::vector<double>>> questions_, answers_;
  bool given_up_ = false;
};

} // namespace gewebe::compliance
