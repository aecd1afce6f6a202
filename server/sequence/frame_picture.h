// The file of one frame of a sequence: its picture, or its layers with what they are. Render thread.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "server/render/renderer.h"
#include "server/sequence/sequence.h"
#include "server/session/query.h"
#include "server/trace/reference.h"

namespace gonio::sequence {

// What makes pictures, and what is kept between two frames.
struct Renderers {
    std::function<Renderer&()> renderer;        // asked for only where a picture needs one: the reference has no GL
    std::shared_ptr<const trace::World> world;  // of the reference, of the frame before
};

// Result: what each of the frame's pictures is asked for with: one, or that of each layer that has a view. Errors: of
// check_capture; "unsupported" where layers are denoised.
Result<std::vector<CaptureRequest>> requests_of(const Sequence& sequence, const Scene& scene);

struct TakenPicture {
    CapturedPicture picture;
    std::optional<trace::Progress> traced;  // of the reference
    std::optional<double> noise;            // likewise, once it is known: denoised, where the picture is
};
// Result: nothing after a stop.
std::optional<TakenPicture> take_picture(Renderers& renderers, const Scene& scene, const CaptureRequest& request,
                                         const std::stop_token& stop);

// Result: the file's bytes; nothing after a stop. Errors: of encoding; those of requests_of.
Result<std::optional<std::vector<std::byte>>> frame_bytes(Renderers& renderers, const Scene& scene,
                                                          const Sequence& sequence, int frame,
                                                          const std::stop_token& stop);

// Results of rays through the pixels' centres, rows from the top, 0 where there is no surface. Glass is a surface.
struct SurfaceLayers {
    std::vector<float> depth_m;  // along the view axis
    std::vector<float> normal;   // 3 a pixel, world, unit, towards the eye; normal maps are in it
    std::vector<float> id;       // of the node: 1 + its place among the scene's instances
};
SurfaceLayers surface_layers(const Scene& scene, int width_px, int height_px);

}  // namespace gonio::sequence
