// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/feature_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "takt/signals/patch.h"

namespace takt {

namespace {

/// A corner is the same while its patch correlates by this with what was seen first, found this near to where its
/// window went.
constexpr double same_correlation = 0.8, same_place_px = 1.5;

struct Track {
  std::int64_t id;
  cv::Point2f at;  ///< px at working size
  Patch seen_first;
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();  ///< how `seen_first` is warped by now
};

/// The image pyramid as calcOpticalFlowPyrLK takes it: image and derivative of each level in turn.
struct Pyramid {
  std::vector<cv::Mat> planes;
  int top_level = 0;
  [[nodiscard]] const cv::Mat& image(int level) const { return planes[2 * static_cast<std::size_t>(level)]; }
};

/// OpenCV wants a mutable pointer; nothing here writes through it.
cv::Mat view(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

GrayImage as_image(const cv::Mat& m) {
  return {m.cols, m.rows, static_cast<std::ptrdiff_t>(m.step), m.data, nullptr};
}

int reduction_for(int width, int full_size_width) {
  int reduction = 1;
  while (width / reduction > full_size_width) reduction *= 2;
  return reduction;
}

/// Averaging r×r pixels puts the centre of a small pixel at the centre of its block.
cv::Point2f to_working(const Vec2& p, int r) {
  const double shift = 0.5 * (r - 1);
  return {static_cast<float>((p.x() - shift) / r), static_cast<float>((p.y() - shift) / r)};
}
Vec2 to_full(const cv::Point2f& p, int r) {
  const double shift = 0.5 * (r - 1);
  return {r * static_cast<double>(p.x) + shift, r * static_cast<double>(p.y) + shift};
}

/// One cell a feature: where a cell has none, a new corner is sought.
struct Grid {
  Grid(cv::Size size, int features)
      : cell_px(std::max(8.0, std::sqrt(static_cast<double>(size.area()) / std::max(features, 1)))),
        columns(std::max(1, static_cast<int>(size.width / cell_px))),
        rows(std::max(1, static_cast<int>(size.height / cell_px))),
        size_px(size),
        taken(static_cast<std::size_t>(columns * rows), 0) {}

  [[nodiscard]] std::size_t cell_of(const cv::Point2f& p) const {
    const int x = std::clamp(static_cast<int>(p.x * static_cast<float>(columns) / static_cast<float>(size_px.width)), 0,
                             columns - 1);
    const int y =
        std::clamp(static_cast<int>(p.y * static_cast<float>(rows) / static_cast<float>(size_px.height)), 0, rows - 1);
    return static_cast<std::size_t>(y * columns + x);
  }
  [[nodiscard]] cv::Rect cell(std::size_t i) const {
    const int c = static_cast<int>(i) % columns, r = static_cast<int>(i) / columns;
    const cv::Point upper_left(c * size_px.width / columns, r * size_px.height / rows);
    const cv::Point lower_right((c + 1) * size_px.width / columns, (r + 1) * size_px.height / rows);
    return {upper_left, lower_right};
  }

  double cell_px;
  int columns, rows;
  cv::Size size_px;
  std::vector<int> taken;  ///< features in each cell
};

}  // namespace

struct FeatureTracker::State {
  FeatureTrackerOptions options;
  Pyramid previous, current;
  cv::Size size;
  int reduction = 1;
  std::vector<Track> tracks;
  std::int64_t next_id = 0;
  std::size_t sought = 0;

  /// Where each track is in the current image: found there and found back, or `closure` < 0.
  struct Followed {
    std::vector<cv::Point2f> to;
    std::vector<float> closure_px;
    std::size_t survivors = 0;
  };

  void build_pyramid(const GrayImage& image);
  [[nodiscard]] Followed follow(const FlowPrediction& predict) const;
  [[nodiscard]] std::optional<Track> find_again(const Track& track, const cv::Point2f& about) const;
  [[nodiscard]] std::vector<FeatureMatch> keep(const Followed& followed);
  void replenish();
  void find_corner(const cv::Rect& cell);
  [[nodiscard]] bool inside(const cv::Point2f& p) const {
    const auto margin = static_cast<float>(options.window_px / 2);
    return p.x >= margin && p.y >= margin && p.x < static_cast<float>(size.width) - margin &&
           p.y < static_cast<float>(size.height) - margin;
  }
};

FeatureTracker::FeatureTracker(FeatureTrackerOptions options) : state_(std::make_unique<State>()) {
  if (options.features < 1 || options.window_px < 5 || options.levels < 1 || options.full_size_width_px < 64)
    throw std::invalid_argument("FeatureTracker: features " + std::to_string(options.features) + ", window " +
                                std::to_string(options.window_px) + " px, levels " + std::to_string(options.levels) +
                                ", full-size width " + std::to_string(options.full_size_width_px) + " px");
  state_->options = options;
}
FeatureTracker::~FeatureTracker() = default;
FeatureTracker::FeatureTracker(FeatureTracker&&) noexcept = default;
FeatureTracker& FeatureTracker::operator=(FeatureTracker&&) noexcept = default;

std::size_t FeatureTracker::alive() const {
  return state_->tracks.size();
}
std::size_t FeatureTracker::sought() const {
  return state_->sought;
}
int FeatureTracker::reduction() const {
  return state_->reduction;
}

std::vector<FeatureMatch> FeatureTracker::observe(const GrayImage& image, const FlowPrediction& predict) {
  if (image.empty() || image.width < 1 || image.height < 1)
    throw std::invalid_argument("FeatureTracker: image of " + std::to_string(image.width) + "×" +
                                std::to_string(image.height) + " px");
  State& s = *state_;
  s.build_pyramid(image);
  s.sought = s.tracks.size();
  std::vector<FeatureMatch> matches;
  if (!s.tracks.empty()) {
    State::Followed followed = s.follow(predict);
    const double survived = static_cast<double>(followed.survivors) / static_cast<double>(s.sought);
    if (predict && survived < s.options.prediction_failed_below) {
      State::Followed again = s.follow({});
      if (again.survivors > followed.survivors) followed = std::move(again);
    }
    matches = s.keep(followed);
  }
  s.replenish();
  std::swap(s.previous, s.current);
  return matches;
}

void FeatureTracker::State::build_pyramid(const GrayImage& image) {
  reduction = reduction_for(image.width, options.full_size_width_px);
  cv::Mat working = view(image);
  if (reduction > 1) {
    cv::Mat reduced;
    const cv::Size target(image.width / reduction, image.height / reduction);
    const cv::Rect whole_blocks(0, 0, target.width * reduction, target.height * reduction);
    cv::resize(working(whole_blocks), reduced, target, 0, 0, cv::INTER_AREA);
    working = reduced;
  }
  if (working.size() != size) {
    tracks.clear();
    size = working.size();
  }
  current.top_level =
      cv::buildOpticalFlowPyramid(working, current.planes, {options.window_px, options.window_px}, options.levels - 1,
                                  true, cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
}

FeatureTracker::State::Followed FeatureTracker::State::follow(const FlowPrediction& predict) const {
  std::vector<cv::Point2f> from(tracks.size());
  std::transform(tracks.begin(), tracks.end(), from.begin(), [](const Track& t) { return t.at; });
  Followed out;
  out.to = from;
  if (predict)
    for (cv::Point2f& p : out.to)
      if (const auto expected = predict(to_full(p, reduction))) {
        const cv::Point2f w = to_working(*expected, reduction);
        if (inside(w)) p = w;
      }

  const cv::Size window(options.window_px, options.window_px);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
  const int top = std::min(previous.top_level, current.top_level);
  std::vector<std::uint8_t> found, found_back;
  cv::calcOpticalFlowPyrLK(previous.planes, current.planes, from, out.to, found, cv::noArray(), window, top, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  // The way back starts at the answer it should give, so two levels are enough to tell a wrong match from a right one.
  std::vector<cv::Point2f> back = from;
  cv::calcOpticalFlowPyrLK(current.planes, previous.planes, out.to, back, found_back, cv::noArray(), window,
                           std::min(top, 1), stop, cv::OPTFLOW_USE_INITIAL_FLOW);

  out.closure_px.assign(from.size(), -1);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const cv::Point2f miss = back[i] - from[i];
    const float closure = std::hypot(miss.x, miss.y);
    if (!found[i] || !found_back[i] || !inside(out.to[i]) || !(closure <= options.forward_backward_px)) continue;
    out.closure_px[i] = closure;
    ++out.survivors;
  }
  return out;
}

/// The corner as it was seen first, warped, near where its window went; where it no longer looks like that, it is
/// remembered anew as it is now.
std::optional<Track> FeatureTracker::State::find_again(const Track& track, const cv::Point2f& about) const {
  const GrayImage picture = as_image(current.image(0));
  const Vec2 start(about.x, about.y);
  Track now = track;
  if (const auto found = track.seen_first.find(picture, {start, track.shape});
      found && found->correlation > same_correlation && (found->place.at - start).norm() < same_place_px) {
    now.at = {static_cast<float>(found->place.at.x()), static_cast<float>(found->place.at.y())};
    now.shape = found->place.shape;
    return now;
  }
  auto anew = Patch::cut(picture, start, options.window_px);
  if (!anew) return std::nullopt;
  return Track{track.id, about, std::move(*anew)};
}

std::vector<FeatureMatch> FeatureTracker::State::keep(const Followed& followed) {
  std::vector<FeatureMatch> matches;
  std::vector<Track> survivors;
  Grid grid(size, options.features);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (followed.closure_px[i] < 0) continue;
    auto now = find_again(tracks[i], followed.to[i]);
    if (!now) continue;
    matches.push_back({now->id, to_full(tracks[i].at, reduction), to_full(now->at, reduction),
                       static_cast<float>(reduction) * followed.closure_px[i]});
    // Where tracks crowd together the older ones (they come first) go on.
    if (grid.taken[grid.cell_of(now->at)]++ < 2) survivors.push_back(std::move(*now));
  }
  tracks = std::move(survivors);
  return matches;
}

void FeatureTracker::State::replenish() {
  if (static_cast<double>(tracks.size()) >= options.fewer_than_share * options.features) return;
  Grid grid(size, options.features);
  for (const Track& t : tracks) ++grid.taken[grid.cell_of(t.at)];
  for (std::size_t i = 0; i < grid.taken.size(); ++i)
    if (grid.taken[i] == 0) find_corner(grid.cell(i));
}

/// Adds the best corner of the cell, if it has one. Looks at half the working size, where a corner that is only noise
/// has faded.
void FeatureTracker::State::find_corner(const cv::Rect& cell) {
  const int level = std::min(1, current.top_level);
  const cv::Mat& image = current.image(level);
  const int margin = (options.window_px / 2 >> level) + 1;
  cv::Rect area(cell.x >> level, cell.y >> level, cell.width >> level, cell.height >> level);
  area &= cv::Rect(margin, margin, image.cols - 2 * margin, image.rows - 2 * margin);
  if (area.width < 3 || area.height < 3) return;

  cv::Mat strength;
  cv::cornerMinEigenVal(image(area), strength, 5, 3);
  double best = 0;
  cv::Point at;
  cv::minMaxLoc(strength, nullptr, &best, nullptr, &at);
  // cornerMinEigenVal's gradients are twice those per pixel, and its greys run from 0 to 1.
  if (std::sqrt(std::max(best, 0.0)) * 255 / 2 < options.contrast_per_px) return;
  const auto scale = static_cast<float>(1 << level);
  const cv::Point2f p(scale * static_cast<float>(area.x + at.x), scale * static_cast<float>(area.y + at.y));
  if (!inside(p)) return;
  if (auto patch = Patch::cut(as_image(current.image(0)), {p.x, p.y}, options.window_px))
    tracks.push_back({next_id++, p, std::move(*patch)});
}

}  // namespace takt
