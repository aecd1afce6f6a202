// What the render session asks of a renderer. The renderer proper is Renderer (renderer.h); NullRenderer
// (server/session/null_renderer.h) makes grey pictures without any GL, for tests of everything around it. Render thread
// only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/report.pb.h"
#include "server/base/clock.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"

namespace gonio {

// A live frame that has left the GPU.
struct FinishedFrame {
    v1::FrameReport report;
    int width_px = 0, height_px = 0;
    std::shared_ptr<const std::vector<std::uint8_t>> nv12;  // null where the picture was clean
    std::int64_t drained_ns = 0, rendered_ns = 0;
};

// A captured picture, rows from the top. Exactly one of rgba8 (display) and values (the view's unit) is filled.
struct CapturedPicture {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgba8;  // 4 per pixel, sRGB-encoded
    std::vector<float> values;        // 4 per pixel: rgb and 1 where there is a surface
    std::vector<float> haze;          // 3 per pixel: of the values what haze scatters to the eye; empty: there is none
    v1::FrameReport report;
    bool denoised = false;
};

// Samples of edges: of a picture at rest and, unless it asks for another number, of a capture; and at most.
inline constexpr unsigned kSamplesPerPixel = 16, kMostSamplesPerPixel = 64;

// A capture between its tiles: a value copy of the scene, and the picture as far as it is.
struct FirstBounces;
struct CaptureJob {
    Scene scene;
    View view = View::beauty;
    bool raw = false;
    int bounces = trace::kAllBounces;               // of indirect light: all, 1 or 0; the seed technique has one
    unsigned samples_per_pixel = kSamplesPerPixel;  // of edges: 1 to kMostSamplesPerPixel
    int tile_px = 4096, next_tile = 0;
    std::int64_t started_ns = 0;
    std::int64_t first_bounce_ns = 0;             // spent on narrow lights
    std::shared_ptr<FirstBounces> first_bounces;  // what came of it
    std::shared_ptr<CapturedPicture> picture;
    std::string failure;  // why it cannot be made: it is complete then, and no picture; empty: it can
    int columns() const { return (picture->width_px + tile_px - 1) / tile_px; }  // of tiles
    int rows() const { return (picture->height_px + tile_px - 1) / tile_px; }
};

// Result: a reading of these lux, rgb; errors, samples and bounces are its maker's. Any thread.
v1::MeterReading lux_reading(const glm::dvec3& point_m, const glm::dvec3& direct_lx, const glm::dvec3& indirect_lx);

// part: light after bounces comes from fewer links than there are to be, with a larger stated error.
enum class Readiness : std::uint8_t { none, part, all };

class LiveRenderer {
public:
    virtual ~LiveRenderer() = default;

    // Starts a live frame of the scene: runs what moved. drained_ns: when its commands left the queue.
    virtual void begin_frame(const Scene& scene, std::int64_t drained_ns) = 0;
    // How much work the next live frames are: an index into kQualityLevels.
    virtual void set_quality_level(std::size_t quality_level) = 0;
    // Whether the live picture gets better while nothing moves; by default it stays as it is.
    virtual void set_refinement(bool wanted) = 0;
    // Whether anybody looks; by default somebody does. While nobody does, nor asks for a capture, a meter or the
    // transport itself, nothing of the transport is made.
    virtual void set_watched(bool watched) = 0;
    // Does a part of that, up to some 0.2 s, for the scene of the last begin_frame. interrupted: asked every
    // few milliseconds, whether to stop at once. Result: whether another frame of the same scene shows something
    // better.
    virtual bool refine(const Scene& scene, const std::function<bool()>& interrupted) = 0;
    // Whether refine() has nothing left to do.
    virtual bool refined(const Scene& scene) = 0;
    // Result: the oldest frame begun, if it has left the GPU; `wait` blocks for it. Frames leave in order.
    virtual std::optional<FinishedFrame> finish_frame(bool wait) = 0;
    virtual std::size_t frames_in_flight() const = 0;
    // Result: the picture of the last begin_frame() as a capture holds it, with the marks of isolux lines; empty where
    // shaders make none. Waits for the GPU.
    virtual CapturedPicture live_picture() { return {}; }
    // Whether the newest live frame is all there is to come of its scene: else one more frame of the same scene shows
    // more of it.
    virtual bool settled() const = 0;
    // Result: how much of the scene's light captures and meters would hold by now. Begins what is missing.
    virtual Readiness ready(const Scene& scene) = 0;
    // Captures and meters wait for scenes of these assets. What ready() has begun for them is kept while another scene
    // is shown; what it began for others is given up. By default there are none.
    virtual void set_awaited(const std::vector<const SceneAsset*>& assets) = 0;
    // Result: what is known of the scene's transport (PROTOCOL.md). From then on it is made, looked at or not.
    virtual v1::TransportStats transport_stats() = 0;

    // Starts a capture of the scene as it is now, at its own size; the live passes stay clean. With raw, values are in
    // the view's unit (lux, cd/m², cd, m) in full precision instead of display colours. Sizes are at least 1.
    virtual std::unique_ptr<CaptureJob> begin_capture(const Scene& scene, View view, int width_px, int height_px,
                                                      bool raw) = 0;
    // Renders the job's next tile, a bounded amount of work, so that live frames come in between. Result: whether the
    // picture is complete.
    virtual bool continue_capture(CaptureJob& job) = 0;
    // Illuminance at a point. Quality interactive: a shadow ray, and links of the point's own to the transport's
    // surfels (bounces: all, 1 or 0). Quality rsm: direct likewise, indirect the unoccluded sum over all RSM texels in
    // double precision. Errors: of the mean of 16 independent parts and the transport's own; of the two halves of a
    // checkerboard of texels; none for the seed techniques. Throws gl::ProgramError where a program that it needs does
    // not link.
    enum class MeterQuality { interactive, rsm };
    virtual v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal,
                                   MeterQuality quality, int bounces = trace::kAllBounces) = 0;
};

}  // namespace gonio
