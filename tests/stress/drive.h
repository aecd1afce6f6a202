// What the cases share: scenes of pieces, driving a scene through every way it can be rendered, and the checks that
// hold for every buffer of every scene.
#pragma once

#include <functional>
#include <span>

#include "server/render/inspect.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"
#include "tests/stress/stress.h"

namespace gonio::stress {

// Gives every part of the scene a revision that no scene had before: one renderer sees them all.
void renew(Scene& scene);

struct Placed {
    Mesh mesh;
    Material material;
    glm::dmat4 world_from_mesh{1.0};
};
// A scene of the pieces and the lights, 48 × 48, renewed. lights: name, position, orientation, profile, multiplier.
Scene scene_of_pieces(std::vector<Placed> pieces, std::vector<LightSeed> lights, std::vector<Image> images = {});
LightSeed light_seed(std::shared_ptr<const Profile> profile, const glm::dvec3& position,
                     const glm::dquat& orientation = orientation_of({}));
Material matte(double reflectance);

// Quads of a box; inwards: a room.
std::vector<Placed> box(const glm::dvec3& min, const glm::dvec3& max, double reflectance, bool inwards);

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
