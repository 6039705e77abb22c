#pragma once
// Frictional contact by an interior-point method: for contacts so many that their forces are not
// determined, where pivoting and Newton's steps on the conditions themselves fail.
//
// With x = (μ f_n, f_t) and z = (g/μ + |s|, s) in each contact, f and g, s as in contact_solver.h,
// the conditions are those of second-order cones, |x_t| <= x_n, |z_t| <= z_n, x·z = 0 (De Saxcé's
// change of variables: De Saxcé, Feng, The bipotential method, 1998; Acary, Cadoux, Lemaréchal,
// Malick, A formulation of the linear discrete Coulomb friction problem via convex optimization,
// 2011). Steps are Mehrotra's predictor and corrector with Nesterov and Todd's scaling
// (Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010); |s| is linearised in
// each of them.

#include <Eigen/Core>

#include <functional>
#include <span>

namespace gewebe {

/// \param w symmetric and positive semidefinite, q: by contact one row (of n) where its friction is
/// 0, else three (n, t1, t2) \param done is asked of forces f, in these rows, with each step: true
/// ends it   \return false where it led nowhere
bool follow_contact_centre(const Eigen::MatrixXd& w, const Eigen::VectorXd& q,
                           std::span<const double> friction, int max_steps,
                           const std::function<bool(const Eigen::VectorXd&)>& done);

} // namespace gewebe
