// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/recording/message_file.h"
#include "takt/streams/streams.h"

namespace takt {

/// IMUs and cameras of a message file: sensor_msgs/Imu, Image, CompressedImage, and CameraInfo in the same name space.
/// A stream is named after its topic; its stamps are the messages' own, the recorder's times are its `arrivals`.
/// Pictures are decoded from their chunk when asked for. Throws takt::Error, naming `path`, where there is no such
/// stream; `repair` is what to try for a broken file.
[[nodiscard]] Recording message_streams(const std::shared_ptr<const MessageFile>& file, const std::string& path,
                                        const std::string& repair);

}  // namespace takt
