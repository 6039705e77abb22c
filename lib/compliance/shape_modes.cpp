#include "compliance/shape_modes.h"

#include <cmath>
#include <utility>

namespace gewebe::compliance {

namespace {

constexpr double within_span = 1e-11;

double dot(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += a[k] * b[k];
  return sum;
}

} // namespace

void ShapeModes::clear() {
  questions_.clear();
  answers_.clear();
  given_up_ = false;
}

bool ShapeModes::express(std::span<const double> question, std::vector<double>& coefficients,
                         std::vector<double>& rest) const {
  coefficients.assign(questions_.size(), 0);
  rest.assign(question.begin(), question.end());
  for (int twice = 0; twice < 2; ++twice) // Gram and Schmidt, and once more for what rounding left
    for (std::size_t k = 0; k < questions_.size(); ++k) {
      const double c = dot(*questions_[k], rest);
      coefficients[k] += c;
      for (std::size_t r = 0; r < rest.size(); ++r)
        rest[r] -= c * (*questions_[k])[r];
    }
  return std::sqrt(dot(rest, rest)) <= within_span * std::sqrt(dot(question, question));
}

void ShapeModes::add(std::vector<double> question, std::vector<double> answer) {
  questions_.push_back(std::make_shared<const std::vector<double>>(std::move(question)));
  answers_.push_back(std::make_shared<const std::vector<double>>(std::move(answer)));
}

void ShapeModes::give_up() {
  clear();
  given_up_ = true;
}

void ShapeModes::answer(std::span<const double> coefficients, std::span<double> answer) const {
  for (std::size_t k = 0; k < answers_.size(); ++k)
    for (std::size_t r = 0; r < answer.size(); ++r)
      answer[r] += coefficients[k] * (*answers_[k])[r];
}

} // namespace gewebe::compliance
