// SPDX-License-Identifier: Apache-2.0
#include "takt/math/banded.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt {

BandedMatrix::BandedMatrix(int size, int bandwidth) {
  if (size < 0 || bandwidth < 0)
    throw std::invalid_argument("BandedMatrix: size " + std::to_string(size) + ", bandwidth " +
                                std::to_string(bandwidth));
  band_ = Eigen::MatrixXd::Zero(bandwidth + 1, size);
}

void BandedMatrix::add_block(int first, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  const int n = static_cast<int>(block.rows());
  if (block.cols() != n || first < 0 || first + n > size() || n > bandwidth() + 1)
    throw std::invalid_argument("BandedMatrix: a block of " + std::to_string(n) + "×" + std::to_string(block.cols()) +
                                " at " + std::to_string(first) + " does not fit a matrix of size " +
                                std::to_string(size()) + " and bandwidth " + std::to_string(bandwidth()));
  for (int j = 0; j < n; ++j) band_.col(first + j).head(n - j) += block.col(j).tail(n - j);
}

Eigen::MatrixXd BandedMatrix::dense() const {
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(size(), size());
  for (int j = 0; j < size(); ++j)
    for (int i = j; i < size() && i <= j + bandwidth(); ++i) m(i, j) = m(j, i) = (*this)(i, j);
  return m;
}

double BandedMatrix::quadratic_form(int first, const Eigen::Ref<const Eigen::VectorXd>& part) const {
  const int n = static_cast<int>(part.size());
  if (first < 0 || first + n > size() || n > bandwidth() + 1)
    throw std::invalid_argument("BandedMatrix: a functional over [" + std::to_string(first) + ", " +
                                std::to_string(first + n) + ") does not fit in size " + std::to_string(size()) +
                                " and bandwidth " + std::to_string(bandwidth()));
  double sum = 0;
  for (int j = 0; j < n; ++j) {
    const auto below = band_.col(first + j);
    sum += part[j] * (below[0] * part[j] + 2 * below.segment(1, n - j - 1).dot(part.tail(n - j - 1)));
  }
  return sum;
}

namespace {
/// So many right-hand sides are solved together.
constexpr Eigen::Index fewest_side_by_side = 8;

void require_rows(Eigen::Index rows, int n) {
  if (rows != n)
    throw std::invalid_argument("BandedCholesky: " + std::to_string(rows) + " rows for a system of " +
                                std::to_string(n));
}
}  // namespace

BandedCholesky::BandedCholesky(BandedMatrix a) : l_(std::move(a)) {
  const int n = l_.size(), w = l_.bandwidth();
  Eigen::VectorXd rounding(n);
  for (int j = 0; j < n; ++j) rounding[j] = (w + 1) * std::numeric_limits<double>::epsilon() * std::abs(l_(j, j));
  for (int j = 0; j < n; ++j) {
    const int below = std::min(w, n - 1 - j);
    auto column = l_.column(j);
    if (!(column[0] > rounding[j]) || !std::isfinite(column[0])) {
      failed_pivot_ = j;
      return;
    }
    column[0] = std::sqrt(column[0]);
    column.segment(1, below) /= column[0];
    for (int c = 1; c <= below; ++c)
      l_.column(j + c).head(below - c + 1) -= column[c] * column.segment(c, below - c + 1);
  }
}

void BandedCholesky::half_solve_in_place(RowMajorMatrix& x) const {
  const int n = l_.size(), w = l_.bandwidth();
  require_rows(x.rows(), n);
  // Columns that begin further down are left out until they do: `reach` grows, and never shrinks.
  std::vector<Eigen::Index> reach(static_cast<std::size_t>(n));
  Eigen::Index last = 0;
  for (int j = 0; j < n; ++j) {
    for (Eigen::Index k = x.cols(); k > last; --k)
      if (x(j, k - 1) != 0) last = k;
    reach[static_cast<std::size_t>(j)] = last;
  }
  for (int j = 0; j < n; ++j) {
    const Eigen::Index columns = reach[static_cast<std::size_t>(j)];
    if (columns == 0) continue;
    auto row = x.row(j).head(columns);
    row /= l_(j, j);
    const int below = std::min(w, n - 1 - j);
    for (int i = 1; i <= below; ++i) x.row(j + i).head(columns) -= l_(j + i, j) * row;
  }
}

Eigen::MatrixXd BandedCholesky::half_solve(Eigen::MatrixXd b) const {
  const int n = l_.size(), w = l_.bandwidth();
  require_rows(b.rows(), n);
  if (b.cols() >= fewest_side_by_side) {  // long stretches of memory instead of short
    RowMajorMatrix x = b;
    half_solve_in_place(x);
    return x;
  }
  for (Eigen::Index k = 0; k < b.cols(); ++k) {
    auto x = b.col(k);
    for (int j = 0; j < n; ++j) {
      if (x[j] == 0) continue;
      const int below = std::min(w, n - 1 - j);
      x[j] /= l_(j, j);
      x.segment(j + 1, below) -= x[j] * l_.column(j).segment(1, below);
    }
  }
  return b;
}

Eigen::MatrixXd BandedCholesky::back_solve(Eigen::MatrixXd b) const {
  const int n = l_.size(), w = l_.bandwidth();
  require_rows(b.rows(), n);
  for (Eigen::Index k = 0; k < b.cols(); ++k) {
    auto x = b.col(k);
    for (int j = n - 1; j >= 0; --j) {
      const int below = std::min(w, n - 1 - j);
      x[j] = (x[j] - l_.column(j).segment(1, below).dot(x.segment(j + 1, below))) / l_(j, j);
    }
  }
  return b;
}

Eigen::MatrixXd BandedCholesky::solve(Eigen::MatrixXd b) const {
  return back_solve(half_solve(std::move(b)));
}

double BandedCholesky::variance(const Eigen::VectorXd& f) const {
  return half_solve(f).squaredNorm();
}

BandedMatrix BandedCholesky::selected_inverse() const {
  const int n = l_.size(), w = l_.bandwidth();
  BandedMatrix z(n, w);
  // Z·L = L⁻ᵀ, read from the last column to the first: column j of Z needs only Z within the band of later columns.
  for (int j = n - 1; j >= 0; --j) {
    const int below = std::min(w, n - 1 - j);
    const auto l = l_.column(j);
    for (int i = j + below; i >= j; --i) {
      double sum = i == j ? 1 / l[0] : 0;
      for (int k = j + 1; k <= j + below; ++k) sum -= (i > k ? z(i, k) : z(k, i)) * l[k - j];
      z(i, j) = sum / l[0];
    }
  }
  return z;
}

double BandedCholesky::log_determinant() const {
  double sum = 0;
  for (int j = 0; j < l_.size(); ++j) sum += 2 * std::log(l_(j, j));
  return sum;
}

}  // namespace takt
