// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <span>

#include "takt/math/banded.h"

namespace takt {

/// Gauss–Newton's normal equations of a chain with a border: H·x = −g,
///   H = [B E; Eᵀ C], B banded (`band_size` variables), C dense (`border_size` variables, after the band's in order).
class ArrowSystem {
 public:
  /// Neighbouring variables: [first, first + size) of the whole system. Those at or after band_size are of the border.
  struct Block {
    int first;
    int size;
  };

  ArrowSystem(int band_size, int bandwidth, int border_size);

  [[nodiscard]] int band_size() const { return band_.size(); }
  [[nodiscard]] int border_size() const { return static_cast<int>(corner_.rows()); }
  [[nodiscard]] int size() const { return band_size() + border_size(); }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  /// The diagonal of H, for damping and scaling.
  [[nodiscard]] Eigen::VectorXd diagonal() const;
  [[nodiscard]] Eigen::MatrixXd dense() const;

  void set_zero();
  /// Adds one residual's share: H_local = Jᵀ·W·J (symmetric) and g_local = Jᵀ·W·r over the variables of `blocks`, in
  /// their order. Throws std::invalid_argument for a block that is out of range or straddles band and border, sizes
  /// that disagree, or two band variables further apart than the bandwidth.
  void accumulate(std::span<const Block> blocks, const Eigen::Ref<const Eigen::MatrixXd>& h,
                  const Eigen::Ref<const Eigen::VectorXd>& g);
  /// The same from the residual r itself (whitened) and its Jacobian.
  void accumulate_residual(std::span<const Block> blocks, const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                           const Eigen::Ref<const Eigen::VectorXd>& residual);

  /// Adds another system of the same shape; throws std::invalid_argument for a different one.
  void add(const ArrowSystem& other);

  /// The band's variables eliminated: what is left of H and g for the border.
  class Elimination {
   public:
    /// False where B is not positive definite. Then nothing else may be called.
    [[nodiscard]] bool ok() const { return band_.ok(); }
    [[nodiscard]] const Eigen::MatrixXd& schur() const { return schur_; }        ///< C − Eᵀ·B⁻¹·E
    [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }  ///< g_C − Eᵀ·B⁻¹·g_B
    [[nodiscard]] double log_determinant() const { return log_determinant_; }    ///< of B
    /// The band's step, given the border's: −B⁻¹·(g_B + E·x_C).
    [[nodiscard]] Eigen::VectorXd band_step(const Eigen::Ref<const Eigen::VectorXd>& border_step) const;

   private:
    friend class ArrowSystem;
    BandedCholesky band_;
    RowMajorMatrix half_edge_;  ///< L⁻¹·E
    Eigen::VectorXd half_;      ///< L⁻¹·g_B
    Eigen::MatrixXd schur_;
    Eigen::VectorXd gradient_;
    Eigen::VectorXd corner_diagonal_;  ///< of C, with what was eliminated before: what a pivot is judged against
    double log_determinant_ = 0;       ///< of all that was eliminated
  };
  /// In the memory of a system that is not needed any more.
  [[nodiscard]] Elimination eliminate() &&;
  /// A chain cut into stretches: adds what an eliminated stretch leaves for its border, whose variables stand here in
  /// `blocks`, in their order. Determinants and the judgement of pivots include what was eliminated.
  void accumulate(std::span<const Block> blocks, const Elimination& stretch);

  /// What a factorisation gives.
  class Solution {
   public:
    /// False where H (damped) is not positive definite: something is not determined. Then nothing else may be called.
    [[nodiscard]] bool ok() const { return band_.ok() && border_ok_; }
    /// x = −H⁻¹·g.
    [[nodiscard]] const Eigen::VectorXd& step() const { return step_; }
    /// Covariance of the border with the band marginalised: (C − Eᵀ·B⁻¹·E)⁻¹.
    [[nodiscard]] const Eigen::MatrixXd& border_covariance() const { return border_covariance_; }
    /// fᵀ·H⁻¹·f over the whole system (band and border).
    [[nodiscard]] double variance(const Eigen::VectorXd& f) const;
    [[nodiscard]] double log_determinant() const;  ///< of H

   private:
    friend class ArrowSystem;
    Elimination band_;
    bool border_ok_ = false;
    double border_log_determinant_ = 0;
    Eigen::VectorXd step_;
    Eigen::MatrixXd border_covariance_;
  };
  /// Factors H + damping·diag(H) (Marquardt's scaling; 0 for Gauss–Newton) and solves.
  [[nodiscard]] Solution solve(double damping = 0) const&;
  /// The same in the memory of a system that is not needed any more.
  [[nodiscard]] Solution solve(double damping = 0) &&;

 private:
  void check(std::span<const Block> blocks, Eigen::Index rows, Eigen::Index gradient_rows) const;
  void add_to_band(int row, int column, const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& part);

  BandedMatrix band_;
  RowMajorMatrix edge_;     ///< E, band_size × border_size
  Eigen::MatrixXd corner_;  ///< C
  Eigen::VectorXd gradient_;
  // What stretches that were eliminated into this system took with them.
  Eigen::VectorXd eliminated_diagonal_;  ///< of C
  double eliminated_log_determinant_ = 0;
};

}  // namespace takt
