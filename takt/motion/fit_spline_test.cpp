// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/fit_spline.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <ctime>
#include <random>

namespace takt {
namespace {

std::vector<double> evenly(int count, double duration) {
  std::vector<double> t(count);
  for (int i = 0; i < count; ++i) t[i] = duration * i / (count - 1);
  return t;
}

template <int Order>
Eigen::MatrixXd design(const std::vector<double>& times, const UniformKnots<Order>& knots) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(times.size(), knots.control_points());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const KnotPlace p = knots.locate(times[i]);
    a.row(i).segment<Order>(p.first) = weights_at<Order, 0>(uniform_basis<Order>(), p.u, 1).value;
  }
  return a;
}

TEST(FitSpline, IsTheLeastSquaresSolution) {
  const auto times = evenly(50, 2);
  const auto knots = UniformKnots<4>::covering(2, 0.25);
  const Eigen::Matrix<double, 2, Eigen::Dynamic> values = Eigen::MatrixXd::Random(2, 50);
  std::vector<double> weights(50);
  for (int i = 0; i < 50; ++i) weights[i] = 0.2 + i % 3;
  const auto fit = fit_spline<2, 4>(times, values, knots, 0, weights);
  const Eigen::VectorXd root = Eigen::Map<Eigen::VectorXd>(weights.data(), 50).cwiseSqrt();
  const Eigen::MatrixXd a = root.asDiagonal() * design<4>(times, knots);
  const Eigen::MatrixXd expected = a.colPivHouseholderQr().solve(root.asDiagonal() * values.transpose());
  EXPECT_LT((fit.spline.control_points() - expected.transpose()).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_NEAR(fit.rms, (a * expected - root.asDiagonal() * values.transpose()).norm() / std::sqrt(100.0), 1e-12);
  const Eigen::MatrixXd covariance = (a.transpose() * a).inverse();
  const Eigen::VectorXd at = design<4>({0.77}, knots).row(0);
  EXPECT_NEAR(fit.variance(0.77), at.dot(covariance * at), 1e-12);
}

TEST(FitSpline, RoughnessIsTheIntegralOfTheSquaredSecondDerivative) {
  const EuclideanSpline<1, 6> spline(0.3, Eigen::RowVectorXd::Random(12));
  double closed = 0;
  const Eigen::MatrixXd gram = roughness_of_basis<6>();
  for (int s = 0; s < spline.knots().segments(); ++s) {
    const Eigen::VectorXd c = spline.control_points().row(0).segment(s, 6);
    closed += c.dot(gram * c) / (0.3 * 0.3 * 0.3);
  }
  double summed = 0;  // midpoint rule: error of order step²
  const int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const double a = spline.evaluate((i + 0.5) * spline.duration_s() / steps).acceleration[0];
    summed += a * a * spline.duration_s() / steps;
  }
  EXPECT_NEAR(closed, summed, 1e-6 * closed);
}

TEST(FitSpline, ConvergesWithItsOrder) {
  // Halving the interval of a quintic must divide the error of a sine by about 2⁶ once the interval is short against
  // the sine: ω·h = 0.6 and 0.3, where the next term of the expansion weighs (ω·h)².
  const auto times = evenly(2000, 10);
  Eigen::RowVectorXd values(2000);
  for (int i = 0; i < 2000; ++i) values[i] = std::sin(3 * times[i]);
  const auto error = [&](double interval) {
    const auto fit = fit_spline<1, 6>(times, values, UniformKnots<6>::covering(10, interval));
    double worst = 0;
    for (double t = 1; t < 9; t += 0.0137) worst = std::max(worst, std::abs(fit.spline(t)[0] - std::sin(3 * t)));
    return worst;
  };
  EXPECT_NEAR(std::log2(error(0.2) / error(0.1)), 6, 0.36);
}

TEST(FitSpline, SaysHowWellItKnowsTheCurve) {
  // Over many draws of the noise, (fit − truth)² must average to the variance it claims.
  const auto times = evenly(120, 3);
  const auto knots = UniformKnots<5>::covering(3, 0.3);
  const auto truth = [](double t) { return 1 - t + t * t; };
  const double sigma = 0.2;
  const std::vector<double> weights(120, 1 / (sigma * sigma));
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, sigma);
  const int draws = 2000;
  double sum = 0, claimed = 0;
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::RowVectorXd values(120);
    for (int i = 0; i < 120; ++i) values[i] = truth(times[i]) + noise(random);
    const auto fit = fit_spline<1, 5>(times, values, knots, 0, weights);
    sum += std::pow(fit.spline(1.234)[0] - truth(1.234), 2);
    claimed = fit.variance(1.234);
  }
  // χ² of 2000 draws: standard deviation of the ratio 3.2 %; 4 of them, one false alarm in 16 000.
  EXPECT_NEAR(sum / draws / claimed, 1, 0.127);
}

TEST(FitSpline, AGapIsBridgedStraightOrRefused) {
  std::vector<double> times;
  for (double t : evenly(200, 10))
    if (t < 4 || t > 6) times.push_back(t);
  Eigen::RowVectorXd values(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) values[i] = 2 - 3 * times[i];
  const auto knots = UniformKnots<6>::covering(10, 0.2);
  EXPECT_THROW((void)(fit_spline<1, 6>(times, values, knots)), std::invalid_argument);
  const auto fit = fit_spline<1, 6>(times, values, knots, 1e-9);
  EXPECT_NEAR(fit.spline(5)[0], 2 - 15, 1e-6);
}

TEST(FitSpline, RefusesBadInput) {
  const auto knots = UniformKnots<4>::covering(1, 0.5);
  const std::vector<double> times{0, 0.5, 1, 1.1};
  EXPECT_THROW((void)(fit_spline<1, 4>(times, Eigen::RowVectorXd::Zero(4), knots)), std::out_of_range);
  EXPECT_THROW((void)(fit_spline<1, 4>(times, Eigen::RowVectorXd::Zero(3), knots)), std::invalid_argument);
}

// A pendulum's recording: 20 000 samples, 6 000 knots. Dense algebra would need 288 MB and minutes.
TEST(FitSpline, IsLinearInTheSamples) {
  const auto seconds = [](int count) {
    const auto times = evenly(count, count / 333.0);
    Eigen::RowVectorXd values(count);
    for (int i = 0; i < count; ++i) values[i] = 0.2 * std::cos(4.2 * times[i]);
    const auto knots = UniformKnots<6>::covering(times.back(), 0.01);
    const std::clock_t start = std::clock();  // processor time: a busy machine does not count
    const auto fit = fit_spline<1, 6>(times, values, knots);
    EXPECT_LT(fit.rms, 1e-9);
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  EXPECT_LT(seconds(20000), 1.0);
}

}  // namespace
}  // namespace takt
