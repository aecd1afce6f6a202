#include "server/http/lane_metrics.h"

namespace gonio {

void count_frame(Metrics& metrics, const EncodedFrame& frame, std::string_view codec) {
    const bool video = codec == "h264";
    const char* lane = video ? lane_kind(frame.lane) : "mjpeg";
    metrics
        .counter("frames_encoded_total", "Frames that left an encoder.",
                 label("codec", codec) + "," + label("lane", lane))
        .add();
    if (video && frame.key) metrics.counter("idr_total", "Key frames that left an encoder.", label("lane", lane)).add();
}

Histogram& send_seconds(Metrics& metrics) {
    return metrics.histogram("send_seconds", "From giving a frame to a socket until the system has taken all of it.");
}

void show_lanes(const SessionRegistry& registry) {
    Metrics& metrics = *registry.options.metrics;
    const std::string& now = registry.video.newest_encoder();
    for (const char* encoder : {"h264_nvenc", "h264_vaapi", "libx264", "mjpeg"})
        metrics.gauge("encoder_info", "1 for the encoder of the video.", label("encoder", encoder))
            .set(encoder == now ? 1 : 0);
    struct Sum {
        unsigned lanes = 0, viewers = 0;
        double bitrate_bps = 0;
    };
    std::map<std::string, Sum> sums = {{"private", {}}, {"shared", {}}, {"low", {}}};
    for (const LaneRequest& request : registry.lanes.requests(Lanes::Time::clock::now())) {
        Sum& sum = sums[lane_kind(request.lane)];
        ++sum.lanes;
        sum.viewers += request.viewers;
        sum.bitrate_bps += request.bitrate_bps();
    }
    for (const auto& [kind, sum] : sums) {
        const std::string lane = label("lane", kind);
        metrics.gauge("lanes", "Lanes, each an encoder, that have viewers.", lane).set(sum.lanes);
        metrics.gauge("lane_viewers", "Viewers of H.264.", lane).set(sum.viewers);
        metrics.gauge("encoder_bitrate_bps", "What measured links let the lanes' encoders take; 0: all.", lane)
            .set(sum.bitrate_bps);
    }
    std::size_t in_flight = registry.lanes.bytes_in_flight();
    registry.for_each([&](const Peer& peer) { in_flight += peer.waiting_bytes(); });
    metrics
        .gauge("inflight_bytes",
               "Video that was given to viewers' sockets and is not acknowledged, and messages that wait for clients.")
        .set(static_cast<double>(in_flight));
    Counter& gated = metrics.counter("client_gated_total", "How often a viewer was made to wait for a key frame.");
    gated.add(registry.lanes.gatings() - gated.value());
}

}  // namespace gonio
