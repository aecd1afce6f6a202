// The renderer: live frames through a readback ring, captures and meters at once. Owns all GPU state. Render thread
// only.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "ies/result.h"
#include "protocol/gonio.pb.h"
#include "server/gl/context.h"
#include "server/render/gpu_scene.h"
#include "server/render/graph.h"
#include "server/render/light_gpu.h"
#include "server/render/programs.h"
#include "server/render/target.h"
#include "server/scene/scene.h"

namespace gonio {

struct FrameInputs;
struct Inspected;
struct Timers;

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
    v1::FrameReport report;
};

// A capture between its tiles: a value copy of the scene, and the picture as far as it is.
struct CaptureJob {
    Scene scene;
    View view = View::beauty;
    bool raw = false;
    int tile_px = 0, next_tile = 0;
    std::int64_t started_ns = 0;
    std::shared_ptr<CapturedPicture> picture;
};

std::int64_t monotonic_ns();

class Renderer {
public:
    explicit Renderer(const gl::Context& context);
    ~Renderer();

    // Starts a live frame of the scene: runs what moved. drained_ns: when its commands left the queue.
    void begin_frame(const Scene& scene, std::int64_t drained_ns);
    // Result: the oldest frame begun, if it has left the GPU; `wait` blocks for it. Frames leave in order.
    std::optional<FinishedFrame> finish_frame(bool wait);
    std::size_t frames_in_flight() const { return in_flight_.size(); }

    // Starts a capture of the scene as it is now, at its own size; the live passes stay clean. raw: values in the
    // view's unit (lux, cd/m², cd, m) in full precision instead of display colours. Sizes are at least 1.
    std::unique_ptr<CaptureJob> begin_capture(const Scene& scene, View view, int width_px, int height_px, bool raw);
    // Renders the job's next tile, a bounded amount of work, so that live frames come in between. Result: whether the
    // picture is complete.
    bool continue_capture(CaptureJob& job);
    // Both in one, for whoever has time.
    std::shared_ptr<const CapturedPicture> capture(const Scene& scene, View view, int width_px, int height_px,
                                                   bool raw);
    // Illuminance at a point: interactive: the picture's own shadow, VPLs and occlusion; rsm: direct likewise, indirect
    // the unoccluded sum over all RSM texels in double precision.
    enum class MeterQuality { interactive, rsm };
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality);

    // From now on visits what every pass writes, of live frames, captures and meters, before anything uses it
    // (server/render/inspect.h). Slow: everything is read back. Empty: stops.
    void inspect_with(std::function<void(const Inspected&)> visit);

private:
    struct InFlight;

    void prepare(const Scene& scene);
    v1::FrameReport run(const FrameInputs& inputs, std::vector<SlotRef> wanted, Timers& timers);
    FrameInputs inputs_of(const Scene& scene, const Target& target, const Eye& eye);

    Programs programs_;
    std::unique_ptr<GpuScene> geometry_;
    std::map<std::uint32_t, LightGpu> lights_;  // by Light::id
    std::map<const Profile*, std::weak_ptr<const WebGpu>> webs_;
    std::map<std::pair<const Profile*, unsigned>, std::weak_ptr<const indirect::VplRays>> rays_;  // and VPLs per subset
    std::shared_ptr<const trace::Geometry> traced_;
    indirect::Pool pool_;
    Ledger ledger_;
    Target live_;
    std::uint32_t next_target_ = 1;
    std::deque<std::unique_ptr<InFlight>> in_flight_;
    std::vector<gl::Buffer> free_readbacks_;
    std::size_t readback_bytes_ = 0;
    std::function<void(const Inspected&)> inspector_;
};

}  // namespace gonio
