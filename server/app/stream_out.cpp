#include "server/app/stream_out.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "protocol/schema/session.pb.h"

namespace gonio {

LaneEncoders::Setup encoder_setup(const Options& options, int width_px, int height_px) {
    LaneEncoders::Setup setup;
    setup.open = [](const std::string& kind, int width, int height) { return H264Encoder::open(width, height, kind); };
    std::string why;
    setup.kinds = working_encoders(options.encoder, width_px, height_px, setup.open, [&](const std::string& line) {
        spdlog::info("encoder {}", line);
        why = line;
    });
    if (setup.kinds.empty() && options.encoder != "auto" && options.encoder != "mjpeg")
        throw std::runtime_error("--encoder " + options.encoder + " does not work here: " + why);
    if (setup.kinds.empty())
        spdlog::warn("there is no H.264: viewers get MJPEG and stills");
    else
        spdlog::info("encoder {}", setup.kinds.front());
    return setup;
}

LaneEncoders::Outputs encoder_outputs(const std::shared_ptr<HttpServer>& http_server, std::function<void()> wake) {
    LaneEncoders::Outputs out;
    out.stream = [&http_server](LaneId lane, const VideoStream& stream) {
        v1::VideoConfig config;
        config.set_codec(stream.codec);
        config.set_encoder(stream.encoder);
        config.set_width_px(static_cast<std::uint32_t>(stream.width_px));
        config.set_height_px(static_cast<std::uint32_t>(stream.height_px));
        http_server->publish_video_config(std::move(config), lane);
    };
    out.h264 = [&http_server](EncodedFrame frame, bool final) { http_server->publish_h264(std::move(frame), final); };
    out.jpeg = [&http_server](EncodedFrame frame) { http_server->publish_jpeg(std::move(frame)); };
    out.idle = std::move(wake);
    out.given_up = [&http_server] {
        spdlog::error("no H.264 encoder works any more: viewers get MJPEG and stills");
        http_server->stop_h264();
    };
    out.trouble = [](const std::string& line) { spdlog::warn("encoder: {}", line); };
    return out;
}

void add_lane_figures(v1::Stats& stats, const LaneEncoders& encoders, const LaneFeed& feed, unsigned mjpeg_clients,
                      std::int64_t now_ns) {
    stats.set_frames_encoded(encoders.frames_encoded());
    stats.set_encoder(encoders.encoder());
    stats.set_settled(feed.at_rest(now_ns));
    for (const auto& [request, counts] : feed.rows()) {
        v1::Lane& lane = *stats.add_lanes();
        lane.set_kind(lane_kind(request.lane));
        lane.set_encoder(counts.encoder);
        lane.set_viewers(request.viewers);
        lane.set_frames(counts.frames);
        lane.set_key_frames(counts.keys);
        lane.set_bitrate_bps(request.bitrate_bps());
        lane.set_gated(request.gated);
    }
    if (mjpeg_clients == 0) return;
    v1::Lane& lane = *stats.add_lanes();
    lane.set_kind("mjpeg");
    lane.set_encoder("jpeg");
    lane.set_viewers(mjpeg_clients);
    lane.set_frames(encoders.jpeg_frames());
}

}  // namespace gonio
