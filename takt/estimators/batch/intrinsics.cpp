// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/intrinsics.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "takt/estimators/batch/evidence.h"
#include "takt/estimators/batch/lens_fit.h"
#include "takt/estimators/batch/lens_rival.h"
#include "takt/estimators/batch/residual_field.h"

namespace takt::batch {

namespace {

constexpr std::size_t fewest_corners = 8;
constexpr std::size_t fewest_frames = 3;  // two unknown views leave a pinhole's centre free
constexpr std::size_t trusted_views = 8;
constexpr int most_rounds = 300;  // xi and the focal length of the unified models creep along a valley
constexpr std::size_t frames_of_a_start = 16;
constexpr int rounds_of_a_start = 12;
constexpr std::size_t finalists = 3;
constexpr double stray_sigmas = 5;
/// Errors that corners share are no noise. Below a fiftieth of a pixel they are the detector's, and in σ.
constexpr double least_systematic_px = 0.02, systematic_share = 0.5;
constexpr double rayleigh_median = 1.17741;  // of the length of a two-dimensional standard normal vector
constexpr double degree = std::numbers::pi / 180;

/// Frames with enough corners, evenly over the recording; in each stretch the one with the most.
std::vector<std::size_t> choose_frames(const CornerStream& s, std::size_t most) {
  std::vector<std::size_t> good;
  for (std::size_t i = 0; i < s.size(); ++i)
    if (s.corners[i].size() >= fewest_corners) good.push_back(i);
  if (good.size() <= most) return good;
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < most; ++k) {
    const auto begin = good.begin() + static_cast<std::ptrdiff_t>(k * good.size() / most);
    const auto end = good.begin() + static_cast<std::ptrdiff_t>((k + 1) * good.size() / most);
    chosen.push_back(*std::max_element(
        begin, end, [&](std::size_t a, std::size_t b) { return s.corners[a].size() < s.corners[b].size(); }));
  }
  return chosen;
}

/// A lens as it comes, with this focal length at the picture's middle.
/// `other`: on the double sphere's second branch, where a larger xi and alpha bend alike.
CameraModel plain_lens(const IntrinsicsOptions& o, int width, int height, double focal_px, bool other = false) {
  CameraModel m;
  m.width = width, m.height = height;
  m.projection = o.projection, m.distortion = o.distortion;
  double wider = 1;  // the unified models shrink the middle
  if (o.projection == Projection::omni) m.shape = {1}, wider = 2;
  if (o.projection == Projection::double_sphere) m.shape = {-0.2, 0.5}, wider = 0.8;
  if (o.projection == Projection::double_sphere && other) m.shape = {0.45, 0.72}, wider = 1.45;
  if (o.projection == Projection::eucm) m.shape = {0.5, 1};
  if (o.distortion == Distortion::fov) m.coeffs = {0.5};
  m.fx = m.fy = wider * focal_px;
  m.cx = 0.5 * (width - 1), m.cy = 0.5 * (height - 1);
  return m;
}

std::vector<BoardView> first_views(const CornerStream& s, const CameraModel& model,
                                   const std::vector<std::size_t>& frames) {
  std::vector<BoardView> views;
  for (const std::size_t i : frames) {
    const auto pose = pose_by_homography(model, s.board, s.corners[i]);
    if (!pose) continue;
    BoardView view;
    view.frame = i;
    view.corners = s.corners[i];
    view.T_cam_board = *pose;
    views.push_back(std::move(view));
  }
  return views;
}

/// The median distance of the corners, as the σ of one coordinate.
double robust_sigma(const LensFit& fit, const std::vector<Vec3>& board) {
  std::vector<double> distances;
  for (const BoardView& v : fit.views)
    for (const CornerObservation& c : v.corners) {
      const auto at = fit.model.project(v.T_cam_board * board[static_cast<std::size_t>(c.corner)]);
      distances.push_back(at ? (*at - c.pixel).norm() : 1e3);
    }
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle / rayleigh_median;
}

/// `count` of the frames, evenly.
std::vector<std::size_t> some_of(const std::vector<std::size_t>& frames, std::size_t count) {
  std::vector<std::size_t> some;
  count = std::min(frames.size(), count);
  for (std::size_t k = 0; k < count; ++k) some.push_back(frames[k * frames.size() / count]);
  return some;
}

/// Lenses to start from: a grid of focal lengths, a few steps each on a few frames; the best first.
std::vector<CameraModel> find_starts(const CornerStream& s, int width, int height, const IntrinsicsOptions& o,
                                     const std::vector<std::size_t>& frames, bool other) {
  const std::vector<std::size_t> few = some_of(frames, frames_of_a_start);
  std::vector<std::pair<double, CameraModel>> starts;
  for (double focal = 0.25 * width; focal < 5 * width; focal *= 1.35) {
    const CameraModel plain = plain_lens(o, width, height, focal, other);
    std::vector<BoardView> views = first_views(s, plain, few);
    if (views.size() < std::max<std::size_t>(2, few.size() / 2)) continue;
    const auto used = static_cast<double>(views.size());
    const LensFit fit = fit_lens(plain, std::move(views), s.board, 3, rounds_of_a_start, o.threads);
    starts.emplace_back(fit.cost / used, fit.model);
  }
  std::stable_sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<CameraModel> best;
  for (std::size_t k = 0; k < std::min(starts.size(), finalists); ++k) best.push_back(starts[k].second);
  return best;
}

/// The best starts, followed to the end on more frames, because the unified models have valleys that lead nowhere.
struct Start {
  CameraModel model;
  std::optional<CameraModel> twin;
};
std::optional<Start> find_start(const CornerStream& s, int width, int height, const IntrinsicsOptions& o,
                                const std::vector<std::size_t>& frames) {
  std::vector<CameraModel> starts = find_starts(s, width, height, o, frames, false);
  if (o.projection == Projection::double_sphere)
    for (const CameraModel& m : find_starts(s, width, height, o, frames, true)) starts.push_back(m);
  std::vector<LensFit> fits;
  for (const CameraModel& start : starts) {
    LensFit fit = fit_lens(start, first_views(s, start, some_of(frames, 3 * frames_of_a_start)), s.board, 3,
                           most_rounds / 3, o.threads);
    if (!fit.views.empty()) fits.push_back(std::move(fit));
  }
  if (fits.empty()) return std::nullopt;
  const auto best =
      std::min_element(fits.begin(), fits.end(), [](const LensFit& a, const LensFit& b) { return a.cost < b.cost; });
  double corners = 0;
  for (const BoardView& v : best->views) corners += static_cast<double>(v.corners.size());
  const double as_well = best->cost * (1 + 9 / (2 * corners));  // χ² within 9
  Start out{best->model, std::nullopt};
  for (const LensFit& fit : fits) {
    if (fit.cost > as_well || std::abs(std::log(fit.model.fx / out.model.fx)) < 0.2) continue;
    if (o.projection != Projection::double_sphere) continue;  // elsewhere one valley joins the two, and σ says so
    out.twin = fit.model;
    if (fit.model.fx < out.model.fx) std::swap(out.model, *out.twin);  // the usual branch
  }
  return out;
}

/// Leaves out what is further off than the noise allows, frames with too little left included; counts them.
std::size_t drop_strays(LensFit& fit, const std::vector<Vec3>& board, double limit_px) {
  std::size_t dropped = 0;
  for (BoardView& v : fit.views) {
    const std::size_t before = v.corners.size();
    std::erase_if(v.corners, [&](const CornerObservation& c) {
      const auto at = fit.model.project(v.T_cam_board * board[static_cast<std::size_t>(c.corner)]);
      return !at || (*at - c.pixel).norm() > limit_px;
    });
    if (v.corners.size() < fewest_corners) v.corners.clear();
    v.stray += static_cast<int>(before - v.corners.size());
    dropped += before - v.corners.size();
  }
  std::erase_if(fit.views, [](const BoardView& v) { return v.corners.empty(); });
  return dropped;
}

CalibratedCamera refusal(const CameraModel& model, const std::string& reason) {
  CalibratedCamera out;
  out.model = model;
  out.reasons.push_back(reason);
  return out;
}

void doubt(CalibratedCamera& c, const std::string& reason) {
  c.verdict = worse(c.verdict, Verdict::weak);
  c.reasons.push_back(reason);
}

/// How much of the picture was seen, and how much the board was tilted.
void measure_views(CalibratedCamera& c) {
  Vec2 low = Vec2::Constant(1e9), high = Vec2::Constant(-1e9);
  for (const BoardView& v : c.views) {
    for (const CornerObservation& o : v.corners) low = low.cwiseMin(o.pixel), high = high.cwiseMax(o.pixel);
    const Vec3 normal = v.T_cam_board.rotation * Vec3::UnitZ();
    c.largest_tilt_rad = std::max(c.largest_tilt_rad, std::acos(std::min(1.0, std::abs(normal.z()))));
  }
  c.covered_width = (high.x() - low.x()) / c.model.width;
  c.covered_height = (high.y() - low.y()) / c.model.height;
}

/// How many views differ from each other: turned by 3° or moved by a twentieth of the distance. Up to `enough`.
std::size_t different_views(const std::vector<BoardView>& views, std::size_t enough) {
  std::vector<const Rigid*> seen;
  for (const BoardView& v : views) {
    const bool is_new = std::none_of(seen.begin(), seen.end(), [&](const Rigid* other) {
      const Rigid step = v.T_cam_board * other->inverse();
      return log_so3(step.rotation).norm() < 3 * degree &&
             (v.T_cam_board.translation - other->translation).norm() < 0.05 * other->translation.norm();
    });
    if (is_new) seen.push_back(&v.T_cam_board);
    if (seen.size() == enough) break;
  }
  return seen.size();
}

void judge(CalibratedCamera& c) {
  c.verdict = Verdict::trusted;
  if (const std::size_t views = different_views(c.views, trusted_views); views < trusted_views)
    doubt(c, fmt::format("only {} different views of the board in {} frames: take at least {}", views, c.frames,
                         trusted_views));
  if (c.largest_tilt_rad < 15 * degree)
    doubt(c, fmt::format("the board is never tilted by more than {:.0f} degrees: tilt it by 30 about both axes",
                         c.largest_tilt_rad / degree));
  if (c.covered_width < 0.6 || c.covered_height < 0.6)
    doubt(c, fmt::format("the board covers {:.0f} % of the picture's width and {:.0f} % of its height: the lens is "
                         "unknown beyond",
                         100 * c.covered_width, 100 * c.covered_height));
  if (c.twin)
    doubt(c, fmt::format("xi {:.2f}, alpha {:.2f} explain these pictures as well as xi {:.2f}, alpha {:.2f}: come so "
                         "close that the board fills the picture's corners, or take EUCM, which has no such twin",
                         c.twin->shape[0], c.twin->shape[1], c.model.shape[0], c.model.shape[1]));
  const int f = shape_count(c.model.projection);
  const double focal_share = c.sigma[f] / c.model.fx;
  if (focal_share > 0.01)
    doubt(c, fmt::format("the focal length is known to {:.1f} % only: come closer and tilt the board more",
                         100 * focal_share));
  if (c.rms_px > 1)
    doubt(c, fmt::format("corners lie {:.2f} px off in the mean: another model, a bent board or blurred pictures?",
                         c.rms_px));
  if (c.systematic_px > std::max(least_systematic_px, systematic_share * c.corner_sigma_px))
    doubt(c, fmt::format("corners miss by {:.3f} px in the same way wherever they are seen in one part of the picture: "
                         "another --lens, or a board that is not flat",
                         c.systematic_px));
  const double strays = static_cast<double>(c.strays) / static_cast<double>(c.strays + c.corners);
  if (strays > 0.1) doubt(c, fmt::format("{:.0f} % of the corners do not fit", 100 * strays));
}

}  // namespace

CalibratedCamera calibrate_intrinsics(const CornerStream& s, int width, int height, const IntrinsicsOptions& o) {
  if (width < 1 || height < 1) throw std::invalid_argument(fmt::format("a picture of {} x {} px", width, height));
  const CameraModel plain = plain_lens(o, width, height, width);
  const std::vector<std::size_t> frames = choose_frames(s, o.most_frames);
  if (frames.size() < fewest_frames)
    return refusal(plain, fmt::format("{} frames show the board well enough, {} are needed: is it the right target?",
                                      frames.size(), fewest_frames));
  const auto start = find_start(s, width, height, o, frames);
  if (!start)
    return refusal(plain, "no focal length explains the board's shape in the pictures: is it the right target?");

  LensFit fit = fit_lens(start->model, first_views(s, start->model, frames), s.board, 3, most_rounds, o.threads);
  std::size_t strays = 0;
  for (int round = 0; round < 4; ++round) {
    const double sigma = std::max(0.003, robust_sigma(fit, s.board));
    const std::size_t dropped = drop_strays(fit, s.board, stray_sigmas * sigma);
    strays += dropped;
    if (fit.views.size() < fewest_frames)
      return refusal(fit.model, "no lens explains the corners: is it the right target, flat and undamaged?");
    fit = fit_lens(fit.model, std::move(fit.views), s.board, 3 * sigma, most_rounds, o.threads);
    if (dropped == 0) break;
  }

  CalibratedCamera out;
  out.model = fit.model;
  out.twin = start->twin;
  out.views = std::move(fit.views);
  out.frames = out.views.size();
  out.strays = strays;
  double squares = 0;
  std::vector<Vec2> seen_at, off;
  for (const BoardView& v : out.views)
    for (const CornerObservation& c : v.corners) {
      const auto at = out.model.project(v.T_cam_board * s.board[static_cast<std::size_t>(c.corner)]);
      seen_at.push_back(c.pixel);
      off.push_back(at ? Vec2(*at - c.pixel) : Vec2(Vec2::Zero()));
      squares += off.back().squaredNorm();
      ++out.corners;
    }
  const double residuals = 2.0 * static_cast<double>(out.corners);
  const double unknowns = static_cast<double>(intrinsics_of(out.model).size()) + 6.0 * static_cast<double>(out.frames);
  if (residuals < unknowns + 10)
    return refusal(out.model, "too few corners for as many unknowns: show more of the board");
  out.rms_px = std::sqrt(squares / residuals);
  out.corner_sigma_px = std::sqrt(squares / (residuals - unknowns));

  const Eigen::VectorXd scale = fit.information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd alike = scale.cwiseInverse().asDiagonal() * fit.information * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(alike);
  if (!fit.converged)
    return refusal(out.model,
                   fmt::format("the fit had not come to rest after {} rounds; this is no result", fit.rounds));
  if (!(eigen.eigenvalues()[0] > 1e-10))
    return refusal(out.model, "the pictures leave the lens undetermined: tilt the board about both axes, near and far");
  const Eigen::MatrixXd inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  // Where corners of one part of the picture share an error, there are as many independent ones as their means scatter.
  const ResidualField field = residual_field(seen_at, off, width, height, out.corner_sigma_px);
  const double shared = field.is_clear() ? field.chi2_per_dof : 1;
  if (field.is_clear()) out.systematic_px = field.systematic_px;
  out.covariance = shared * out.corner_sigma_px * out.corner_sigma_px * scale.cwiseInverse().asDiagonal() * inverse *
                   scale.cwiseInverse().asDiagonal();
  out.sigma = out.covariance.diagonal().cwiseSqrt();
  std::vector<Vec2> seen_less_predicted;
  for (const Vec2& miss : off) seen_less_predicted.push_back(-miss);
  out.panels = {scatter_panel(seen_less_predicted),
                radial_panel(seen_at, seen_less_predicted, out.model, out.corner_sigma_px), coverage_panel(out.views)};
  measure_views(out);
  judge(out);
  if (field.is_clear())
    if (const auto rival = find_lens_rival(out.model, out.views, s.board, out.corner_sigma_px, o.threads))
      doubt(out, fmt::format("{} fits these corners better (noise {:.4f} px instead of {:.4f}): give it with --lens",
                             rival->name, rival->noise_px, out.corner_sigma_px));
  return out;
}

std::optional<CameraPair> relate_cameras(const CornerStream& before, const CalibratedCamera& before_found,
                                         const CornerStream& stream, const CalibratedCamera& found,
                                         double tolerance_s) {
  // Each common frame gives T = T_cn_board·T_cnm1_board⁻¹, with the noise of both poses; how both lenses' errors move
  // it is shared by all frames.
  struct Seen {
    Rigid T;
    Mat6 weight;
    Eigen::MatrixXd to_lens_before, to_lens;
  };
  std::vector<Seen> seen;
  for (const BoardView& a : before_found.views)
    for (const BoardView& b : found.views) {
      const double apart = 1e-9 * static_cast<double>(to_ns(before.stamps[a.frame]) - to_ns(stream.stamps[b.frame]));
      if (std::abs(apart) > tolerance_s) continue;
      const Rigid T = b.T_cam_board * a.T_cam_board.inverse();
      // A left move ξ of T_cnm1_board moves T by −Ad(T)·ξ.
      const Mat3 R = T.rotation.toRotationMatrix();
      Mat6 adjoint = Mat6::Zero();
      adjoint.topLeftCorner<3, 3>() = adjoint.bottomRightCorner<3, 3>() = R;
      adjoint.topRightCorner<3, 3>() = hat(T.translation) * R;
      const double va = before_found.corner_sigma_px * before_found.corner_sigma_px;
      const double vb = found.corner_sigma_px * found.corner_sigma_px;
      const Mat6 covariance =
          vb * b.information.inverse() + va * adjoint * a.information.inverse() * adjoint.transpose();
      seen.push_back({T, covariance.inverse(), -adjoint * a.to_lens, b.to_lens});
    }
  if (seen.size() < 3) return std::nullopt;

  CameraPair out{seen[seen.size() / 2].T, Vec6::Zero(), seen.size()};
  Mat6 information = Mat6::Zero();
  Eigen::MatrixXd to_lens_before, to_lens;
  double chi2 = 0;
  for (int round = 0; round < 20; ++round) {
    information.setZero();
    to_lens_before.setZero(6, before_found.covariance.rows());
    to_lens.setZero(6, found.covariance.rows());
    Vec6 gradient = Vec6::Zero();
    chi2 = 0;
    for (const Seen& s : seen) {
      const Rigid off = s.T * out.T_cn_cnm1.inverse();
      Vec6 e;
      e << off.translation, log_so3(off.rotation);
      const double d2 = e.dot(s.weight * e), w = 1 / (1 + d2 / (6 * 4));
      information += w * s.weight;
      gradient += w * s.weight * e;
      to_lens_before += w * s.weight * s.to_lens_before;
      to_lens += w * s.weight * s.to_lens;
      chi2 += w * d2;
    }
    const Vec6 step = information.ldlt().solve(gradient);
    out.T_cn_cnm1 = moved(out.T_cn_cnm1, step);
    if (step.norm() < 1e-12) break;
  }
  // Where the frames scatter more than their poses' noise, the answer is as uncertain as they say.
  const double excess = std::max(1.0, chi2 / (6.0 * static_cast<double>(seen.size() - 1)));
  const Mat6 inverse = information.inverse();
  Mat6 covariance = excess * inverse;
  to_lens_before = inverse * to_lens_before, to_lens = inverse * to_lens;
  covariance += to_lens_before * before_found.covariance * to_lens_before.transpose();
  covariance += to_lens * found.covariance * to_lens.transpose();
  out.sigma = covariance.diagonal().cwiseSqrt();
  return out;
}

}  // namespace takt::batch
