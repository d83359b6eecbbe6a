// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_text.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace takt {

namespace {

constexpr std::size_t fold_column = 80;

/// Whether a word stands without quotes: topics and names do.
bool is_plain(const std::string& word) {
  if (word.empty() || word == "null" || word == "Null" || word == "NULL") return false;
  for (const char c : word)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && std::string_view("/_-.~").find(c) == std::string_view::npos)
      return false;
  const char first = word.front();
  return std::isalpha(static_cast<unsigned char>(first)) != 0 || first == '/' || first == '_';
}

bool is_control(char c) {
  return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
}

}  // namespace

std::string kalibr_number(double value) {
  std::string digits = fmt::format("{}", value);
  if (digits.find_first_of(".n") != std::string::npos) return digits;
  const std::size_t exponent = std::min(digits.find('e'), digits.size());
  return digits.insert(exponent, ".0");
}

KalibrText::KalibrText(KalibrStyle style) : style_(style) {
  if (style == KalibrStyle::opencv) text_ = "%YAML:1.0\n---\n";
}

void KalibrText::start(const std::string& key) {
  text_ += std::string(static_cast<std::size_t>(2 * depth_), ' ') + key + ":";
}

void KalibrText::number(const std::string& key, double value) {
  start(key);
  text_ += " " + kalibr_number(value) + "\n";
}
void KalibrText::whole(const std::string& key, long value) {
  start(key);
  text_ += fmt::format(" {}\n", value);
}

void KalibrText::word(const std::string& key, const std::string& value) {
  start(key);
  if (is_plain(value) && style_ == KalibrStyle::kalibr) {
    text_ += " " + value + "\n";
    return;
  }
  // OpenCV takes a bare /topic for no string; control characters can only be written between double quotes.
  std::string quoted;
  const char quote = style_ == KalibrStyle::opencv || std::any_of(value.begin(), value.end(), is_control) ? '"' : '\'';
  for (const char c : value) {
    if (is_control(c)) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
      continue;
    }
    if (quote == '\'' && c == '\'') quoted += '\'';
    if (quote == '"' && (c == '"' || c == '\\')) quoted += '\\';
    quoted += c;
  }
  text_ += " " + (quote + quoted + quote) + "\n";
}

void KalibrText::items(const std::vector<std::string>& values) {
  text_ += "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) {
      text_ += ",";
      const std::size_t column = text_.size() - (text_.rfind('\n') + 1);
      text_ += column > fold_column ? "\n" + std::string(static_cast<std::size_t>(2 * depth_ + 2), ' ') : " ";
    }
    text_ += values[i];
  }
  text_ += "]\n";
}

void KalibrText::list(const std::string& key, const std::vector<double>& values) {
  start(key);
  text_ += " ";
  std::vector<std::string> words;
  for (const double v : values) words.push_back(kalibr_number(v));
  items(words);
}
void KalibrText::whole_list(const std::string& key, const std::vector<int>& values) {
  start(key);
  text_ += " ";
  std::vector<std::string> words;
  for (const int v : values) words.push_back(std::to_string(v));
  items(words);
}

void KalibrText::matrix(const std::string& key, const Eigen::Ref<const Eigen::MatrixXd>& m) {
  start(key);
  text_ += "\n";
  const int indent = 2 * depth_ + (style_ == KalibrStyle::opencv ? 2 : 0);  // OpenCV wants them deeper than the key
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    std::vector<std::string> words;
    for (Eigen::Index c = 0; c < m.cols(); ++c) words.push_back(kalibr_number(m(r, c)));
    text_ += std::string(static_cast<std::size_t>(indent), ' ') + "- ";
    items(words);
  }
}

void KalibrText::open(const std::string& key) {
  start(key);
  text_ += "\n";
  ++depth_;
}
void KalibrText::close() {
  --depth_;
}

}  // namespace takt
