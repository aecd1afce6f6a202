// One luminaire's maps on the GPU, made by the first pass that writes them. Shadow and RSM belong to a position, the
// mask to a profile and an orientation.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/gl/objects.h"
#include "server/lighting/airlight.h"
#include "server/lighting/vpl_rays.h"
#include "server/render/rsm_texels.h"
#include "server/scene/light.h"
#include "server/transport/solve.h"

namespace gonio {

inline constexpr int kRsmSize = 128;      // texels per face side
inline constexpr int kShadowSize = 1024;  // likewise; halved beyond 16 lights, which keeps 64 lights below 0.5 GiB

// A photometric solid: position and normal, 6 floats per vertex, cd.
struct SolidGpu {
    gl::Buffer vertices, indices;
    GLsizei index_count = 0;
};

// What is made of a profile, shared by the lights that use it.
struct WebGpu {
    std::shared_ptr<const Profile> profile;  // with its tables
    const LightTables* tables = nullptr;     // of the profile
    float peak_cd = 0.0f;
    // Where asked for: the tables' words for shaders/lib/web_buffer.glsl (web_buffer), solid_of, rays of the light.
    mutable gl::Buffer buffer;
    mutable std::optional<SolidGpu> solid;
    mutable std::shared_ptr<const lighting::VplRays> rays;
};

struct LightGpu {
    std::shared_ptr<const WebGpu> web;
    std::shared_ptr<const Profile> profile;  // of `web`
    bool live = false;                       // in the scene of the last live frame

    gl::Texture shadow;  // size² × 6 DEPTH32F, near / axis distance, 0: nothing there
    gl::Framebuffer shadow_fbo;
    int shadow_size = 0;
    int rsm_size = kRsmSize;   // RSM in the comments below; benches measure against finer maps
    gl::Texture radial_depth;  // RSM² × 6 R32F, m, 0: nothing there
    gl::Texture normal;        // RSM² × 6 RG16_SNORM, octahedral, world
    gl::Texture albedo;        // RSM² × 6 RGBA16F, linear reflectance
    gl::Texture position;      // RSM² × 6 RGBA32F, light-relative, m; seed technique only
    gl::Texture rsm_depth;     // RSM² × 6 DEPTH32F
    gl::Framebuffer rsm_fbo;
    bool rsm_with_position = false;
    gl::Texture mask;  // mask² × 6 RGBA32F with mip levels: I in cd, I / I_peak, emits
    gl::Framebuffer mask_fbo;
    int mask_size = 0;
    gl::Texture flux;  // RSM² × 6 RGBA32F: lm per cd of peak, area / pi in m²
    gl::Framebuffer flux_fbo;

    // Which faces hold the scene as it is seen from this position.
    struct Faces {
        Revision position_rev = 0, geometry_rev = 0;
        unsigned made = 0;
    };
    Faces shadow_faces, rsm_faces;
    unsigned reached = 63;  // Slot::reached: faces the profile emits into

    RsmTexels texels;  // read back by the flux pass
    std::uint64_t texels_rsm_version = 0;
    std::uint64_t rsm_version = 0;  // counts runs of the rsm pass
    // Of the default technique, per candela of peak × GpuScene::layer_unit_m2.
    std::vector<float> surfel_direct;  // direct illuminance at the transport's surfels
    std::vector<float> surfel_haze;    // likewise what the air scatters there; empty: there is no haze
    lighting::DistanceMap distances;   // of haze
    bool moves = false;                // it has changed since it was solved
    transport::Irradiance irradiance;
    struct Exact {  // the first bounce of a narrow light that rests
        std::vector<lighting::Vpl> vpls;
        std::vector<glm::vec4> first, by_vpls;  // all of it; what comes from afar (lighting::vpl_share)
        std::size_t next = 0;                   // surfel: those before have theirs; all of them: it counts
    } exact;
    bool has_exact() const { return exact.next > 0 && exact.next == exact.first.size(); }
};

std::shared_ptr<const WebGpu> make_web(std::shared_ptr<const Profile> profile);
GLuint web_buffer(const WebGpu& web);
const SolidGpu& solid_of(const WebGpu& web);
int shadow_size_of(std::size_t lights);
// Each makes what is missing. Result: whether the map is new and empty.
bool make_shadow(LightGpu& light, std::size_t lights);
void make_rsm(LightGpu& light, bool with_position);  // with_position: for the seed technique
void make_mask(LightGpu& light);

// Result: the mask's mip level whose texels are as large as the RSM's.
float mask_lod(const LightGpu& light);

// Result: faces of `reached` that are not valid for (position, geometry).
unsigned missing_faces(const LightGpu::Faces& faces, unsigned reached, Revision position_rev, Revision geometry_rev);
void note_faces(LightGpu::Faces& faces, unsigned made, Revision position_rev, Revision geometry_rev);

}  // namespace gonio
