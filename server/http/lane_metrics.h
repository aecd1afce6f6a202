// Frames, encoders and lanes for /metrics. Net thread.
#pragma once

#include "server/http/session_registry.h"

namespace gonio {

// A frame left an encoder. codec: "h264" or "jpeg".
void count_frame(Metrics& metrics, const EncodedFrame& frame, std::string_view codec);

// What sending a frame takes: video messages and MJPEG parts.
Histogram& send_seconds(Metrics& metrics);

// Sets the gauges of the encoder and of the lanes as they are now, and counts what came to them since the last call.
void show_lanes(const SessionRegistry& registry);

}  // namespace gonio
