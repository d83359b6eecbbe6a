// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/join_recordings.h"

#include <algorithm>

#include "takt/recording/stored_picture.h"

namespace takt {

namespace {

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

template <class Stream>
Stream* named(std::vector<Stream>& streams, const std::string& name) {
  const auto found = std::find_if(streams.begin(), streams.end(), [&](const Stream& s) { return s.name == name; });
  return found == streams.end() ? nullptr : &*found;
}

using Open = std::function<std::unique_ptr<FrameReader>()>;

/// The pictures of one reader, then those of another.
class JoinedFrames : public FrameReader, public KeepsStored {
 public:
  JoinedFrames(const Open& first, Open second, std::size_t first_size)
      : reader_(first()), second_(std::move(second)), first_size_(first_size) {}

  std::optional<Frame> next() override {
    std::optional<Frame> frame = reader_->next();
    if (!frame && second_) {
      broken_before_ = reader_->broken();
      base_ = first_size_;
      reader_ = second_();
      second_ = nullptr;
      reader_->skip_to(wanted_ > base_ ? wanted_ - base_ : 0);
      frame = reader_->next();
    }
    broken_ = broken_before_ + reader_->broken();
    if (frame) frame->index += base_;
    return frame;
  }
  void skip_to(std::size_t index) override {
    wanted_ = std::max(wanted_, index);
    reader_->skip_to(second_ ? std::min(index, first_size_) : index - std::min(index, base_));
  }
  [[nodiscard]] std::optional<StoredPicture> stored() const override { return stored_picture(*reader_); }

 private:
  std::unique_ptr<FrameReader> reader_;
  Open second_;
  std::size_t first_size_, base_ = 0, wanted_ = 0, broken_before_ = 0;
};

}  // namespace

void join(Recording& all, Recording next) {
  for (ImuStream& imu : next.imus) {
    ImuStream* const before = named(all.imus, imu.name);
    if (!before) {
      all.imus.push_back(std::move(imu));
      continue;
    }
    // Where one part has no accelerations, the whole has none.
    if (before->accel_m_s2.size() == before->size() && imu.accel_m_s2.size() == imu.size())
      append(before->accel_m_s2, imu.accel_m_s2);
    else
      before->accel_m_s2.clear();
    append(before->stamps, imu.stamps);
    append(before->arrivals, imu.arrivals);
    append(before->gyro_rad_s, imu.gyro_rad_s);
  }
  for (CameraStream& camera : next.cameras) {
    CameraStream* const before = named(all.cameras, camera.name);
    if (!before) {
      all.cameras.push_back(std::move(camera));
      continue;
    }
    before->open = [first = before->open, second = camera.open, size = before->size()] {
      return std::make_unique<JoinedFrames>(first, second, size);
    };
    append(before->stamps, camera.stamps);
    append(before->arrivals, camera.arrivals);
    if (!before->model) before->model = camera.model;
  }
  append(all.files, next.files);
  for (std::string& note : next.notes)
    if (std::find(all.notes.begin(), all.notes.end(), note) == all.notes.end()) all.notes.push_back(std::move(note));
}

}  // namespace takt
