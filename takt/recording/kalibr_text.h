// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/recording/kalibr_files.h"

namespace takt {

/// Writes YAML as Kalibr's own library does: lists of numbers in brackets, broken behind column 80; matrices one row a
/// line. Keys come in the order in which they are written: give them in that of ASCII.
class KalibrText {
 public:
  explicit KalibrText(KalibrStyle style);

  void number(const std::string& key, double value);
  void whole(const std::string& key, long value);
  void word(const std::string& key, const std::string& value);
  void list(const std::string& key, const std::vector<double>& values);
  void whole_list(const std::string& key, const std::vector<int>& values);
  void matrix(const std::string& key, const Eigen::Ref<const Eigen::MatrixXd>& m);
  /// Keys from here to `close` stand below this one.
  void open(const std::string& key);
  void close();

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void start(const std::string& key);
  void items(const std::vector<std::string>& values);

  KalibrStyle style_;
  int depth_ = 0;
  std::string text_;
};

/// The shortest digits that are this double, always with a point: "0.088", "5.0", "1.0e-05".
[[nodiscard]] std::string kalibr_number(double value);

}  // namespace takt
