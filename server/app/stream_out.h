// Joins the encoders of the lanes to the HTTP server and to the counters.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "protocol/schema/messages.h"
#include "server/app/options.h"
#include "server/http/http_server.h"
#include "server/stream/lane_feed.h"

namespace gonio {

// Result: the encoders that work for pictures of this size, tried with a frame each; which and why not is logged.
// Throws std::runtime_error where one was asked for by name and does not work.
LaneEncoders::Setup encoder_setup(const Options& options, int width_px, int height_px);

// Result: what publishes through `http_server`, which must stand before the first picture is encoded. wake: a job is
// done.
LaneEncoders::Outputs encoder_outputs(const std::shared_ptr<HttpServer>& http_server, std::function<void()> wake);

// Fills frames_encoded, encoder, lanes and settled.
void add_lane_figures(v1::Stats& stats, const LaneEncoders& encoders, const LaneFeed& feed, unsigned mjpeg_clients,
                      std::int64_t now_ns);

}  // namespace gonio
