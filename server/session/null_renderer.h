// A renderer without GL: grey pictures whose luma tells the revision, so that everything around the renderer is tested
// where no GL can run, under ThreadSanitizer above all. Chosen by `goniod --renderer null`; no picture of it is light.
#pragma once

#include <deque>

#include "server/render/live_renderer.h"

namespace gonio {

class NullRenderer : public LiveRenderer {
public:
    // Result: the luma of every pixel of a live picture of this revision, 16..235 (BT.709 limited range).
    static std::uint8_t luma_of(Revision scene_rev);

    void begin_frame(const Scene& scene, std::int64_t drained_ns) override;
    void set_quality_level(std::size_t) override {}
    void set_refinement(bool) override {}
    void set_watched(bool) override {}
    bool refine(const Scene&, const std::function<bool()>&) override { return false; }
    bool refined(const Scene&) override { return true; }
    std::optional<FinishedFrame> finish_frame(bool wait) override;
    std::size_t frames_in_flight() const override { return finished_.size(); }
    bool settled() const override { return true; }
    Readiness ready(const Scene&) override { return Readiness::all; }
    void set_awaited(const std::vector<const SceneAsset*>&) override {}
    v1::TransportStats transport_stats() override {
        v1::TransportStats stats;
        stats.set_ready(true);
        return stats;
    }
    // Grey, too: the luma as sRGB, or as the value in the view's unit. One tile.
    std::unique_ptr<CaptureJob> begin_capture(const Scene& scene, View view, int width_px, int height_px,
                                              bool raw) override;
    bool continue_capture(CaptureJob& job) override;
    // Darkness: 0 lx everywhere.
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality,
                           int bounces) override;

private:
    std::deque<FinishedFrame> finished_;
    Revision last_rev_ = 0;
    int last_width_px_ = 0, last_height_px_ = 0;
};

}  // namespace gonio
