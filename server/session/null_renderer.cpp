#include "server/session/null_renderer.h"
#include "server/scene/scene.h"

#include <algorithm>

namespace gonio {

std::uint8_t NullRenderer::luma_of(Revision scene_rev) {
    return static_cast<std::uint8_t>(16 + scene_rev % 220);
}

void NullRenderer::begin_frame(const Scene& scene, std::int64_t drained_ns) {
    FinishedFrame frame;
    frame.width_px = scene.width_px;
    frame.height_px = scene.height_px;
    const bool clean =
        scene.scene_rev == last_rev_ && scene.width_px == last_width_px_ && scene.height_px == last_height_px_;
    if (!clean) {
        const std::size_t pixels = static_cast<std::size_t>(scene.width_px) * static_cast<std::size_t>(scene.height_px);
        std::vector<std::uint8_t> nv12(pixels * 3 / 2, 128);
        std::fill_n(nv12.begin(), pixels, luma_of(scene.scene_rev));
        frame.nv12 = std::make_shared<const std::vector<std::uint8_t>>(std::move(nv12));
    }
    last_rev_ = scene.scene_rev;
    last_width_px_ = scene.width_px;
    last_height_px_ = scene.height_px;
    frame.drained_ns = drained_ns;
    frame.rendered_ns = monotonic_ns();
    frame.report.set_scene_rev(scene.scene_rev);
    frame.report.set_frame_ms(static_cast<double>(frame.rendered_ns - drained_ns) * 1e-6);
    frame.report.set_settled(true);
    frame.report.set_width_px(static_cast<std::uint32_t>(scene.width_px));
    frame.report.set_height_px(static_cast<std::uint32_t>(scene.height_px));
    v1::PassReport& row = *frame.report.add_passes();
    row.set_name("composite");
    row.set_state(clean ? "clean" : "ran");
    finished_.push_back(std::move(frame));
}

std::optional<FinishedFrame> NullRenderer::finish_frame(bool) {
    if (finished_.empty()) return std::nullopt;
    FinishedFrame frame = std::move(finished_.front());
    finished_.pop_front();
    return frame;
}

std::unique_ptr<CaptureJob> NullRenderer::begin_capture(const Scene& scene, View view, int width_px, int height_px,
                                                        bool raw) {
    auto job = std::make_unique<CaptureJob>();
    job->scene = scene;
    job->view = view;
    job->raw = raw;
    job->started_ns = monotonic_ns();
    job->picture = std::make_shared<CapturedPicture>();
    job->picture->width_px = width_px;
    job->picture->height_px = height_px;
    return job;
}

bool NullRenderer::continue_capture(CaptureJob& job) {
    CapturedPicture& picture = *job.picture;
    const std::size_t values =
        static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px) * 4;
    const std::uint8_t grey = luma_of(job.scene.scene_rev);
    if (job.raw)
        picture.values.assign(values, static_cast<float>(grey));
    else
        picture.rgba8.assign(values, grey);
    picture.report.set_scene_rev(job.scene.scene_rev);
    picture.report.set_frame_ms(static_cast<double>(monotonic_ns() - job.started_ns) * 1e-6);
    return true;
}

v1::MeterReading NullRenderer::meter(const Scene&, const glm::dvec3& point, const glm::dvec3&, MeterQuality, int) {
    return lux_reading(point, glm::dvec3(0.0), glm::dvec3(0.0));
}

}  // namespace gonio
