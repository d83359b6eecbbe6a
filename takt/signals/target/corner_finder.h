// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/signals/target/board_layout.h"
#include "takt/signals/target/saddle.h"
#include "takt/streams/corners.h"
#include "takt/streams/image.h"

namespace takt {

/// Finds a board's corners in one picture after the other: where the board was seen just before it is looked for
/// there, else everywhere. No lens model is asked for: every prediction is a homography from corners nearby.
/// What one object finds depends on the pictures that it has seen since `forget`.
class CornerFinder {
 public:
  explicit CornerFinder(const BoardLayout& layout) : layout_(layout) {}

  /// By ascending corner. `t_s` only grows; it scales the board's motion in the picture.
  [[nodiscard]] std::vector<CornerObservation> find(const GrayImage& image, double t_s);
  void forget() { last_ = before_ = {}; }

 private:
  /// One pixel a corner, or none; and when.
  struct Sighting {
    std::vector<std::optional<Vec2>> pixels;
    double t_s = 0;
  };
  /// A place where a corner may be, before it is refined.
  struct Guess {
    int corner;
    Vec2 pixel;
    double furthest_px;  ///< how far from there it may be
  };

  [[nodiscard]] std::vector<Guess> everywhere(const GrayImage& image) const;
  [[nodiscard]] std::vector<Guess> nearby(const GrayImage& image, double t_s) const;
  [[nodiscard]] std::vector<Guess> predicted(double t_s) const;
  /// How the corner should look, given the map of the board around it.
  [[nodiscard]] Crossing appearance(int corner, const Vec2& pixel, const Eigen::Matrix2d& slope) const;
  void snap(const std::vector<Crossing>& crossings, std::vector<Guess>& guesses) const;
  /// Refines, checks and completes guesses; nothing where they are no board.
  [[nodiscard]] std::vector<std::optional<Vec2>> settle(const GrayImage& image, const std::vector<Guess>& guesses);
  [[nodiscard]] std::optional<Vec2> refine(const GrayImage& image, const LayoutCorner& corner, const Vec2& at,
                                           double furthest_px, const Eigen::Matrix2d& slope) const;
  void grow(const GrayImage& image, std::vector<std::optional<Vec2>>& pixels) const;
  void drop_misfits(std::vector<std::optional<Vec2>>& pixels) const;
  [[nodiscard]] bool markers_agree(const GrayImage& image, std::vector<std::optional<Vec2>>& pixels) const;
  /// Whether a checkerboard ends where it should: one that was mistaken by a square goes on.
  [[nodiscard]] bool edges_agree(const GrayImage& image, const std::vector<std::optional<Vec2>>& pixels) const;
  [[nodiscard]] bool is_rightly_coloured(const GrayImage& image, const LayoutCorner& corner, const Vec2& at,
                                         const Eigen::Matrix2d& slope) const;
  void choose_polarity(const GrayImage& image, const std::vector<Guess>& guesses);

  const BoardLayout& layout_;
  double polarity_ = 1;  ///< −1: a checkerboard whose squares have the other colours
  Sighting last_, before_;
};

}  // namespace takt
