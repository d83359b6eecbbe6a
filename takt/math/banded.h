// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

/// Linear algebra of chains, whose variables touch only their neighbours. Everything here is O(n·bandwidth²) in time
/// and O(n·bandwidth) in memory.
namespace takt {

/// A symmetric n×n matrix with entries only where |i − j| ≤ bandwidth; the lower half is stored.
class BandedMatrix {
 public:
  BandedMatrix() = default;
  /// All zero. Throws std::invalid_argument for negative sizes.
  BandedMatrix(int size, int bandwidth);

  [[nodiscard]] int size() const { return static_cast<int>(band_.cols()); }
  [[nodiscard]] int bandwidth() const { return static_cast<int>(band_.rows()) - 1; }
  /// Entry (row, column), row ≥ column, within the band (not checked).
  [[nodiscard]] double& operator()(int row, int column) { return band_(row - column, column); }
  [[nodiscard]] double operator()(int row, int column) const { return band_(row - column, column); }
  /// Column j from its diagonal down: entries (j, j) … (j + bandwidth, j); what lies past the last row is padding.
  [[nodiscard]] auto column(int j) { return band_.col(j); }
  [[nodiscard]] auto column(int j) const { return band_.col(j); }

  void set_zero() { band_.setZero(); }
  /// Adds a symmetric block whose upper left entry stands at (first, first).
  /// Throws std::invalid_argument when it leaves the matrix or the band.
  void add_block(int first, const Eigen::Ref<const Eigen::MatrixXd>& block);
  [[nodiscard]] Eigen::MatrixXd dense() const;

  /// fᵀ·M·f for an f that is zero but for `part`, at [first, first + part.size()). Needs part.size() ≤ bandwidth + 1.
  [[nodiscard]] double quadratic_form(int first, const Eigen::Ref<const Eigen::VectorXd>& part) const;

 private:
  Eigen::MatrixXd band_{1, 0};
};

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A = L·Lᵀ of a symmetric positive definite banded matrix.
class BandedCholesky {
 public:
  BandedCholesky() = default;
  explicit BandedCholesky(BandedMatrix a);

  /// The first variable that is not determined (its pivot is not above rounding of its diagonal entry), or −1 when the
  /// matrix is positive definite. After a failure nothing else may be called.
  [[nodiscard]] int failed_pivot() const { return failed_pivot_; }
  [[nodiscard]] bool ok() const { return failed_pivot_ < 0; }
  [[nodiscard]] int size() const { return l_.size(); }

  /// A⁻¹·b, b one or several columns.
  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd b) const;
  /// L⁻¹·b: half of a solve; bᵀA⁻¹b = |L⁻¹b|².
  [[nodiscard]] Eigen::MatrixXd half_solve(Eigen::MatrixXd b) const;
  /// The same in place, for many columns: row by row, all columns at once.
  void half_solve_in_place(RowMajorMatrix& b) const;
  /// L⁻ᵀ·b: the other half.
  [[nodiscard]] Eigen::MatrixXd back_solve(Eigen::MatrixXd b) const;
  /// fᵀ·A⁻¹·f: the variance of fᵀx when A is the information of x.
  [[nodiscard]] double variance(const Eigen::VectorXd& f) const;
  /// The entries of A⁻¹ within the band of A, without the others [Takahashi1973]. For many variances of functionals
  /// that fit in the band: selected_inverse().quadratic_form(first, weights).
  [[nodiscard]] BandedMatrix selected_inverse() const;
  [[nodiscard]] double log_determinant() const;  ///< of A

 private:
  BandedMatrix l_;
  int failed_pivot_ = -1;
};

}  // namespace takt
