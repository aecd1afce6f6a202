// What the cases share: scenes of pieces, driving a scene through every way it can be rendered, and the checks that
// hold for every buffer of every scene.
#pragma once

#include <functional>
#include <span>

#include "server/render/inspect.h"
#include "server/trace/reference.h"
#include "tests/scenes/placed.h"
#include "tests/scenes/scenes.h"
#include "tests/stress/stress.h"

namespace gonio::stress {

using test::box;
using test::light_seed;
using test::matte;
using test::Placed;
using test::renew;
using test::scene_of_pieces;

struct Meter {
    glm::dvec3 point, normal;
};
// Live frame, PNG and EXR captures and meters, with each technique; every buffer is checked on the way.
void drive(Bench& bench, Scene& scene, std::span<const Meter> meters);
// A meter reading, checked like every other. bounces: as of Renderer::meter.
v1::MeterReading read_meter(Bench& bench, const Scene& scene, const Meter& meter, Renderer::MeterQuality quality,
                            int bounces = trace::kAllBounces);
// Reference readings, checked likewise.
std::vector<trace::Reading> read_reference(Bench& bench, const Scene& scene, std::span<const Meter> meters,
                                           const trace::Settings& settings);
// The largest reflectance of any surface, in any channel; textures only darken.
double greatest_albedo(const SceneAsset& asset);
// Values of a capture, checked likewise; 4 per pixel.
std::vector<float> values_of(Bench& bench, const Scene& scene, View view, int width_px, int height_px,
                             int bounces = trace::kAllBounces);

// While alive, checks every buffer that a renderer writes and shows it to `also`.
class BufferWatch {
public:
    BufferWatch(Bench& bench, std::string group, Inspector also = {});
    ~BufferWatch();

private:
    Bench& bench_;
};

}  // namespace gonio::stress
