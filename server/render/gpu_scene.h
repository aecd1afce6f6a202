// The scene's geometry and images on the GPU, and the draw loop with culling.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/gl/objects.h"
#include "server/render/graph.h"
#include "server/render/programs.h"
#include "server/scene/asset.h"
#include "shaders/shared/layouts.h"

namespace gonio {

// One mesh and where it stands.
struct DrawGroup {
    std::uint32_t first_index = 0, index_count = 0;
    std::int32_t base_vertex = 0;
    int material = 0;
    bool colored = false, mapped = false;  // its vertices have colours, tangents
    std::vector<int> instances;            // indices into SceneAsset::instances
};

class GpuScene {
public:
    explicit GpuScene(std::shared_ptr<const SceneAsset> asset);
    // Bodies of luminaires, for targets of `within`: each instance is nowhere until it is placed.
    GpuScene(std::shared_ptr<const SceneAsset> asset, const GpuScene& within);
    // Of bodies. world_from_mesh: of an instance; nothing: it is not there.
    void place(std::size_t instance, const std::optional<glm::dmat4>& world_from_mesh);

    const SceneAsset& asset() const { return *asset_; }
    bool emissive() const { return emissive_; }
    bool detailed() const { return detailed_; }  // it has normal maps
    // Distance that clips nothing that matters: a hundred-thousandth of the scene's diagonal, m. Depth is reversed and
    // floating, so a small near plane costs no precision.
    float near_m() const { return near_m_; }

    // What irradiance layers are measured in: lux per candela of peak times this area, a power of two near the square
    // of a sixteenth of the scene's diagonal, m². So half floats hold scenes of any size: they end 1/4000 of the
    // diagonal from a luminaire, and lose digits beyond eight diagonals.
    float layer_unit_m2() const { return layer_unit_m2_; }

    enum class Mode { gbuffer, gbuffer_cells, tint, shadow, rsm, rsm_seed };
    // Draws all meshes that meet the view. gbuffer: into the bound framebuffer from `eye`, clip_from_local = projection
    // × view without translation; gbuffer_cells: with Target::cell. The others: into the cube faces of `faces` (bit f)
    // around `eye`. pane_sample: which of sixteen samples this is to transmissive surfaces (pass_threshold), -1: the
    // only one. What is seen through them is tinted by them: the same draw with Mode::tint, which nobody else asks for.
    PassRun draw(Mode mode, Programs& programs, const glm::dvec3& eye, const glm::mat4& clip_from_local, unsigned faces,
                 int pane_sample = -1) const;

private:
    struct Uploaded {
        gl::Buffer vertices, indices;
        gl::Buffer colors, tangents;  // like vertices; none where no mesh has any
        gl::VertexArray vertex_array;
        std::vector<gl::Texture> images;
        gl::Sampler samplers[9];  // wrap_s + 3 · wrap_t
    };
    // Made by the first draw: the CPU's passes need none of it.
    const Uploaded& uploaded() const;
    void use_material(Mode mode, Programs& programs, const DrawGroup& group, const glm::mat4& clip_from_local,
                      int pane_sample) const;

    std::shared_ptr<const SceneAsset> asset_;
    mutable std::unique_ptr<const Uploaded> uploaded_;
    std::vector<DrawGroup> groups_;
    std::vector<Bounds> bounds_;                 // per instance, world
    std::vector<glm::dmat4> places_;             // likewise, world_from_mesh of bodies; else empty: the asset's
    std::vector<std::uint32_t> first_triangle_;  // likewise, among those of all instances
    bool emissive_ = false, detailed_ = false, transmissive_ = false;
    float near_m_ = 1e-4f;
    float layer_unit_m2_ = 1.0f;
};

}  // namespace gonio
