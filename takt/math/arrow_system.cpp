// SPDX-License-Identifier: Apache-2.0
#include "takt/math/arrow_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace takt {

namespace {

/// S −= AᵀA, lower half. Columns of a chain's border often begin further down: where they have not, they cost nothing.
void subtract_square(const RowMajorMatrix& a, Eigen::MatrixXd& s) {
  constexpr Eigen::Index rows_a_piece = 256;
  for (Eigen::Index from = 0; from < a.rows(); from += rows_a_piece) {
    const auto piece = a.middleRows(from, std::min(rows_a_piece, a.rows() - from));
    Eigen::Index reach = a.cols();
    while (reach > 0 && piece.col(reach - 1).isZero(0)) --reach;
    if (reach == 0) continue;
    s.topLeftCorner(reach, reach).selfadjointView<Eigen::Lower>().rankUpdate(piece.leftCols(reach).transpose(), -1);
  }
}

}  // namespace

ArrowSystem::ArrowSystem(int band_size, int bandwidth, int border_size) : band_(band_size, bandwidth) {
  if (border_size < 0) throw std::invalid_argument("ArrowSystem: border of " + std::to_string(border_size));
  edge_ = RowMajorMatrix::Zero(band_size, border_size);
  corner_ = Eigen::MatrixXd::Zero(border_size, border_size);
  gradient_ = Eigen::VectorXd::Zero(band_size + border_size);
  eliminated_diagonal_ = Eigen::VectorXd::Zero(border_size);
}

Eigen::VectorXd ArrowSystem::diagonal() const {
  Eigen::VectorXd d(size());
  for (int j = 0; j < band_size(); ++j) d[j] = band_(j, j);
  d.tail(border_size()) = corner_.diagonal();
  return d;
}

Eigen::MatrixXd ArrowSystem::dense() const {
  Eigen::MatrixXd h(size(), size());
  h << band_.dense(), edge_, edge_.transpose(), corner_;
  return h;
}

void ArrowSystem::set_zero() {
  band_.set_zero();
  edge_.setZero();
  corner_.setZero();
  gradient_.setZero();
  eliminated_diagonal_.setZero();
  eliminated_log_determinant_ = 0;
}

void ArrowSystem::accumulate(std::span<const Block> blocks, const Eigen::Ref<const Eigen::MatrixXd>& h,
                             const Eigen::Ref<const Eigen::VectorXd>& g) {
  check(blocks, h.rows(), g.size());
  const int n = band_size();
  int row = 0;
  for (const Block& a : blocks) {
    gradient_.segment(a.first, a.size) += g.segment(row, a.size);
    int column = 0;
    for (const Block& b : blocks) {
      const auto part = h.block(row, column, a.size, b.size);
      if (a.first >= n && b.first >= n)
        corner_.block(a.first - n, b.first - n, a.size, b.size) += part;
      else if (b.first >= n)
        edge_.block(a.first, b.first - n, a.size, b.size) += part;
      else if (a.first < n)
        add_to_band(a.first, b.first, part);
      column += b.size;
    }
    row += a.size;
  }
}

void ArrowSystem::accumulate_residual(std::span<const Block> blocks, const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                                      const Eigen::Ref<const Eigen::VectorXd>& residual) {
  if (jacobian.rows() != residual.size())
    throw std::invalid_argument("ArrowSystem: " + std::to_string(jacobian.rows()) + " rows of Jacobian for " +
                                std::to_string(residual.size()) + " residuals");
  // Eigen's blocked product costs more to set up than one row's outer product takes.
  if (jacobian.rows() == 1)
    accumulate(blocks, jacobian.transpose().lazyProduct(jacobian), jacobian.transpose() * residual[0]);
  else
    accumulate(blocks, jacobian.transpose() * jacobian, jacobian.transpose() * residual);
}

void ArrowSystem::add(const ArrowSystem& other) {
  if (other.band_size() != band_size() || other.border_size() != border_size() ||
      other.band_.bandwidth() != band_.bandwidth())
    throw std::invalid_argument("ArrowSystem: systems of different shapes cannot be added");
  for (int j = 0; j < band_size(); ++j) band_.column(j) += other.band_.column(j);
  edge_ += other.edge_;
  corner_ += other.corner_;
  gradient_ += other.gradient_;
  eliminated_diagonal_ += other.eliminated_diagonal_;
  eliminated_log_determinant_ += other.eliminated_log_determinant_;
}

/// The part of a block at (row, column) that lies on or below the diagonal.
void ArrowSystem::add_to_band(int row, int column,
                              const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& part) {
  for (int j = 0; j < part.cols(); ++j) {
    const int skip = std::max(0, column + j - row);
    if (skip >= part.rows()) break;
    const auto below = static_cast<int>(part.rows()) - skip;
    band_.column(column + j).segment(row + skip - column - j, below) += part.col(j).tail(below);
  }
}

void ArrowSystem::check(std::span<const Block> blocks, Eigen::Index rows, Eigen::Index gradient_rows) const {
  int total = 0, lowest = band_size(), highest = -1;
  for (const Block& b : blocks) {
    const bool in_band = b.first + b.size <= band_size(), in_border = b.first >= band_size();
    if (b.first < 0 || b.size < 0 || b.first + b.size > size() || !(in_band || in_border))
      throw std::invalid_argument("ArrowSystem: block [" + std::to_string(b.first) + ", " +
                                  std::to_string(b.first + b.size) + ") in a band of " + std::to_string(band_size()) +
                                  " and a border of " + std::to_string(border_size()));
    total += b.size;
    if (!in_border && b.size > 0) {
      lowest = std::min(lowest, b.first);
      highest = std::max(highest, b.first + b.size - 1);
    }
  }
  if (total != rows || total != gradient_rows)
    throw std::invalid_argument("ArrowSystem: blocks of " + std::to_string(total) + " variables, but a matrix of " +
                                std::to_string(rows) + " and a gradient of " + std::to_string(gradient_rows));
  if (highest - lowest > band_.bandwidth())
    throw std::invalid_argument("ArrowSystem: variables " + std::to_string(lowest) + " and " + std::to_string(highest) +
                                " are further apart than the bandwidth " + std::to_string(band_.bandwidth()));
}

ArrowSystem::Solution ArrowSystem::solve(double damping) const& {
  return ArrowSystem(*this).solve(damping);
}

ArrowSystem::Solution ArrowSystem::solve(double damping) && {
  const int n = band_size(), m = border_size();
  for (int j = 0; j < n && damping != 0; ++j) band_(j, j) *= 1 + damping;
  corner_.diagonal() *= 1 + damping;
  Solution s;
  s.band_ = std::move(*this).eliminate();
  if (!s.band_.ok()) return s;

  // Scaled to a unit diagonal of C, so that a pivot at rounding level means: the band can do all that this variable
  // does.
  const Eigen::MatrixXd& schur = s.band_.schur_;
  const Eigen::VectorXd scale =
      s.band_.corner_diagonal_.cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(Eigen::MatrixXd(scale.asDiagonal() * schur * scale.asDiagonal()));
  const double rounding = (n + m) * std::numeric_limits<double>::epsilon();
  const Eigen::MatrixXd l = factor.matrixL();
  s.border_ok_ = factor.info() == Eigen::Success && (l.diagonal().array().square() > rounding).all();
  if (!s.border_ok_) return s;
  s.border_log_determinant_ = 2 * (l.diagonal().array().log().sum() - scale.array().log().sum());
  s.border_covariance_ = scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(m, m)) * scale.asDiagonal();

  s.step_.resize(n + m);
  s.step_.tail(m) = -(s.border_covariance_ * s.band_.gradient_);
  s.step_.head(n) = s.band_.band_step(s.step_.tail(m));
  return s;
}

ArrowSystem::Elimination ArrowSystem::eliminate() && {
  Elimination e;
  const int n = band_size(), m = border_size();
  e.band_ = BandedCholesky(std::move(band_));
  if (!e.band_.ok()) return e;
  e.log_determinant_ = eliminated_log_determinant_ + e.band_.log_determinant();
  e.corner_diagonal_ = corner_.diagonal() + eliminated_diagonal_;
  // With half_edge = L⁻¹E the Schur complement is C − half_edgeᵀ·half_edge.
  e.half_edge_ = std::move(edge_);
  e.band_.half_solve_in_place(e.half_edge_);
  e.schur_ = std::move(corner_);
  subtract_square(e.half_edge_, e.schur_);
  e.schur_.triangularView<Eigen::StrictlyUpper>() = e.schur_.transpose();
  e.half_ = e.band_.half_solve(gradient_.head(n));
  e.gradient_ = gradient_.tail(m) - e.half_edge_.transpose() * e.half_;
  return e;
}

void ArrowSystem::accumulate(std::span<const Block> blocks, const Elimination& stretch) {
  accumulate(blocks, stretch.schur_, stretch.gradient_);
  eliminated_log_determinant_ += stretch.log_determinant_;
  int row = 0;
  for (const Block& b : blocks) {
    if (b.first >= band_size())
      eliminated_diagonal_.segment(b.first - band_size(), b.size) +=
          (stretch.corner_diagonal_ - stretch.schur_.diagonal()).segment(row, b.size);
    row += b.size;
  }
}

Eigen::VectorXd ArrowSystem::Elimination::band_step(const Eigen::Ref<const Eigen::VectorXd>& border_step) const {
  return -band_.back_solve(half_ + half_edge_ * border_step);
}

double ArrowSystem::Solution::log_determinant() const {
  return band_.log_determinant() + border_log_determinant_;
}

double ArrowSystem::Solution::variance(const Eigen::VectorXd& f) const {
  const Eigen::Index n = band_.half_edge_.rows(), m = band_.half_edge_.cols();
  if (f.size() != n + m)
    throw std::invalid_argument("ArrowSystem: a functional of " + std::to_string(f.size()) + " for a system of " +
                                std::to_string(n + m));
  const Eigen::VectorXd half = band_.band_.half_solve(f.head(n));
  const Eigen::VectorXd rest = f.tail(m) - band_.half_edge_.transpose() * half;
  return half.squaredNorm() + rest.dot(border_covariance_ * rest);
}

}  // namespace takt
