// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/picture.h"

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <array>
#include <string_view>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/lower_case.h"
#include "takt/recording/stored_picture.h"

namespace takt {

namespace {

/// Nothing where the file cannot be read.
std::string bytes_in(const std::string& path) {
  try {
    return read_file(path);
  } catch (const Error&) {
    return {};
  }
}

/// A picture of this many pixels is a broken header, not a camera's.
constexpr std::size_t most_bytes = 1U << 30;

constexpr std::string_view png_magic = "\x89PNG", jpeg_magic = "\xFF\xD8";

class PictureReader : public FrameReader, public KeepsStored {
 public:
  explicit PictureReader(std::shared_ptr<const std::vector<PictureFile>> files) : files_(std::move(files)) {}

  std::optional<Frame> next() override {
    while (place_ < files_->size()) {
      const PictureFile& file = (*files_)[place_++];
      encoded_ = bytes_in(file.path);
      GrayImage image = decode_picture(std::as_bytes(std::span(encoded_)));
      if (!image.empty()) return Frame{file.index, file.stamp, file.exposure_s, std::move(image)};
      ++broken_;
    }
    return std::nullopt;
  }

  void skip_to(std::size_t index) override {
    while (place_ < files_->size() && (*files_)[place_].index < index) ++place_;
  }

  [[nodiscard]] std::optional<StoredPicture> stored() const override {
    const std::string_view format = encoded_.starts_with(jpeg_magic)  ? "jpeg"
                                    : encoded_.starts_with(png_magic) ? "png"
                                                                      : "";
    if (format.empty()) return std::nullopt;
    return EncodedPicture{format, std::as_bytes(std::span(encoded_))};
  }

 private:
  std::shared_ptr<const std::vector<PictureFile>> files_;
  std::size_t place_ = 0;
  std::string encoded_;  // the last one
};

/// Whether a PNG or JPEG goes on to its end mark. What is cut off would be half a picture, and a line of the decoder's
/// own on stderr.
bool whole(std::string_view encoded) {
  constexpr std::string_view png_end = "IEND", jpeg_end = "\xFF\xD9";
  if (encoded.starts_with(png_magic)) return encoded.rfind(png_end) != std::string_view::npos;
  if (encoded.starts_with(jpeg_magic)) return encoded.rfind(jpeg_end) != std::string_view::npos;
  return true;
}

}  // namespace

GrayImage decode_picture(std::span<const std::byte> encoded) {
  if (encoded.empty() || encoded.size() > most_bytes) return {};
  if (!whole({reinterpret_cast<const char*>(encoded.data()), encoded.size()})) return {};
  auto pixels = std::make_shared<cv::Mat>();
  try {
    // A view: imdecode reads the bytes in place.
    const cv::Mat bytes(1, static_cast<int>(encoded.size()), CV_8UC1,
                        const_cast<void*>(static_cast<const void*>(encoded.data())));
    *pixels = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return {};
  }
  if (pixels->empty()) return {};
  return {pixels->cols, pixels->rows, static_cast<std::ptrdiff_t>(pixels->step), pixels->data, pixels};
}

GrayImage read_picture(const std::string& path) {
  const std::string encoded = bytes_in(path);
  return decode_picture(std::as_bytes(std::span(encoded)));
}

bool is_picture_file(const std::string& path) {
  constexpr std::array endings{".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif", ".tiff"};
  return std::find(endings.begin(), endings.end(), ending_of(path)) != endings.end();
}

std::unique_ptr<FrameReader> read_pictures(std::shared_ptr<const std::vector<PictureFile>> files) {
  return std::make_unique<PictureReader>(std::move(files));
}

}  // namespace takt
