// A capture in reference quality: the path tracer's values -> the picture that a client asked for. Any thread, no GL.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "server/render/renderer.h"
#include "server/session/query.h"
#include "server/trace/reference.h"

namespace gonio {

struct TracedCapture {
    CapturedPicture picture;  // no report: no pass ran
    trace::Progress progress;
    std::optional<double> denoised_noise;  // trace::Denoised::noise, where the request asks for it
};

// Renders until the noise or the time of request.settings is reached, then filters where the request asks for it;
// `each` is told a few times a second. With one sample per pixel the picture is of pixel centres, else antialiased.
// world: of the scene. A difference is of two pictures that both reach the noise and share the time; the progress in
// the result is that of the one that got less far. Result: nothing if stopped.
std::optional<TracedCapture> trace_capture(const std::shared_ptr<const trace::World>& world, const Scene& scene,
                                           const CaptureRequest& request, std::stop_token stop,
                                           const std::function<void(const trace::Progress&)>& each);

// values: as trace::Picture holds them for the request's view. Result: the picture, exposed and encoded as
// shaders/passes/composite.frag does it, or its values in the view's unit.
CapturedPicture develop(const std::vector<float>& values, const Scene& scene, const CaptureRequest& request);

}  // namespace gonio
