#include "server/render/gpu_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace gonio {
namespace {

Bounds world_bounds(const Mesh& mesh, const glm::dmat4& world_from_mesh) {
    // Interval arithmetic on the matrix: tight for axis-aligned boxes.
    const glm::dvec3 centre = (mesh.bounds.min + mesh.bounds.max) * 0.5,
                     half = (mesh.bounds.max - mesh.bounds.min) * 0.5;
    const glm::dmat3 axes(world_from_mesh);
    const glm::dvec3 c = glm::dvec3(world_from_mesh * glm::dvec4(centre, 1.0));
    const glm::dvec3 h = glm::abs(axes[0]) * half.x + glm::abs(axes[1]) * half.y + glm::abs(axes[2]) * half.z;
    return {c - h, c + h};
}

// A half space dot(normal, p) + offset >= 0 in eye-relative world axes.
using Planes = std::vector<glm::dvec4>;

bool meets(const Planes& planes, const glm::dvec3& centre, const glm::dvec3& half) {
    for (const glm::dvec4& plane : planes) {
        const glm::dvec3 n(plane);
        if (glm::dot(n, centre) + plane.w + glm::dot(glm::abs(n), half) < 0.0) return false;
    }
    return true;
}

Planes camera_planes(const glm::mat4& clip_from_local) {
    const glm::dmat4 rows = glm::transpose(glm::dmat4(clip_from_local));
    return {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1]};
}

Planes face_planes(int face) {
    static const glm::dvec3 kS[6] = {{0, 0, -1}, {0, 0, 1}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0}};
    static const glm::dvec3 kT[6] = {{0, -1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0, -1, 0}, {0, -1, 0}};
    static const glm::dvec3 kM[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const glm::dvec3 s = kS[face], t = kT[face], axis = kM[face];
    return {glm::dvec4(axis + s, 0), glm::dvec4(axis - s, 0), glm::dvec4(axis + t, 0), glm::dvec4(axis - t, 0)};
}

gl::Texture upload_image(const Image& image, int index) {
    const int levels = gl::mip_levels(std::max(image.width_px, image.height_px));
    gl::Texture texture =
        gl::make_texture_2d("image " + std::to_string(index), image.linear ? GL_RGBA8 : GL_SRGB8_ALPHA8, image.width_px,
                            image.height_px, gl::Filter::linear, levels);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(texture.id(), 0, 0, 0, image.width_px, image.height_px, GL_RGBA, GL_UNSIGNED_BYTE,
                        image.rgba.data());
    glGenerateTextureMipmap(texture.id());
    return texture;
}

}  // namespace

GpuScene::GpuScene(std::shared_ptr<const SceneAsset> asset) : asset_(std::move(asset)) {
    groups_.resize(asset_->meshes.size());
    std::size_t vertices = 0, indices = 0;
    for (std::size_t i = 0; i < asset_->meshes.size(); ++i) {
        const Mesh& mesh = asset_->meshes[i];
        groups_[i].first_index = static_cast<std::uint32_t>(indices);
        groups_[i].index_count = static_cast<std::uint32_t>(mesh.indices.size());
        groups_[i].base_vertex = static_cast<std::int32_t>(vertices);
        groups_[i].material = mesh.material;
        groups_[i].colored = !mesh.colors.empty();
        groups_[i].mapped = !mesh.tangents.empty();
        detailed_ |= groups_[i].mapped;
        transmissive_ |= asset_->materials[mesh.material].transmissive();
        vertices += mesh.vertices.size();
        indices += mesh.indices.size();
    }
    std::uint32_t triangles = 0;
    for (std::size_t i = 0; i < asset_->instances.size(); ++i) {
        const Instance& instance = asset_->instances[i];
        DrawGroup& group = groups_[instance.mesh];
        group.instances.push_back(static_cast<int>(i));
        first_triangle_.push_back(triangles);
        triangles += group.index_count / 3;
        bounds_.push_back(world_bounds(asset_->meshes[instance.mesh], instance.world_from_mesh));
    }
    emissive_ = std::any_of(asset_->materials.begin(), asset_->materials.end(),
                            [](const Material& material) { return glm::length(material.emissive_nit) > 0.0f; });
    const double diagonal_m = std::max(glm::length(asset_->bounds.max - asset_->bounds.min), 1e-7);
    near_m_ = static_cast<float>(diagonal_m * 1e-5);
    if (std::isfinite(diagonal_m))
        layer_unit_m2_ = static_cast<float>(std::exp2(std::round(2.0 * std::log2(diagonal_m / 16.0))));
}

GpuScene::GpuScene(std::shared_ptr<const SceneAsset> asset, const GpuScene& within) : GpuScene(std::move(asset)) {
    emissive_ = within.emissive_;
    detailed_ = within.detailed_;
    places_.resize(asset_->instances.size());
    bounds_.assign(places_.size(), Bounds());
    std::iota(first_triangle_.begin(), first_triangle_.end(), 0u);  // which part it is
}

void GpuScene::place(std::size_t instance, const std::optional<glm::dmat4>& world_from_mesh) {
    bounds_[instance] = Bounds();
    if (!world_from_mesh) return;
    places_[instance] = *world_from_mesh;
    bounds_[instance] = world_bounds(asset_->meshes[asset_->instances[instance].mesh], *world_from_mesh);
}

const GpuScene::Uploaded& GpuScene::uploaded() const {
    if (uploaded_) return *uploaded_;
    auto made = std::make_unique<Uploaded>();
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> indices;
    std::vector<glm::u16vec4> colors;
    std::vector<glm::vec4> tangents;
    for (const Mesh& mesh : asset_->meshes) {
        if (!mesh.colors.empty()) {
            colors.resize(vertices.size(), glm::u16vec4(65535));
            colors.insert(colors.end(), mesh.colors.begin(), mesh.colors.end());
        }
        if (!mesh.tangents.empty()) {
            tangents.resize(vertices.size());
            tangents.insert(tangents.end(), mesh.tangents.begin(), mesh.tangents.end());
        }
        vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
        indices.insert(indices.end(), mesh.indices.begin(), mesh.indices.end());
    }
    made->vertices = gl::make_buffer("vertices", std::max<std::size_t>(vertices.size(), 1) * sizeof(Vertex),
                                     vertices.empty() ? nullptr : vertices.data());
    made->indices = gl::make_buffer("indices", std::max<std::size_t>(indices.size(), 1) * 4,
                                    indices.empty() ? nullptr : indices.data());
    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    made->vertex_array = gl::VertexArray(id);
    glVertexArrayVertexBuffer(id, 0, made->vertices.id(), 0, sizeof(Vertex));
    glVertexArrayElementBuffer(id, made->indices.id());
    const auto attribute = [&](GLuint index, GLint size, std::size_t offset, GLuint binding) {
        glEnableVertexArrayAttrib(id, index);
        glVertexArrayAttribFormat(id, index, size, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offset));
        glVertexArrayAttribBinding(id, index, binding);
    };
    attribute(0, 3, offsetof(Vertex, position), 0);
    attribute(1, 3, offsetof(Vertex, normal), 0);
    attribute(2, 2, offsetof(Vertex, uv), 0);
    attribute(3, 4, offsetof(layouts::DrawInstance, row0), 1);
    attribute(4, 4, offsetof(layouts::DrawInstance, row1), 1);
    attribute(5, 4, offsetof(layouts::DrawInstance, row2), 1);
    const std::pair<GLuint, std::size_t> whole[] = {{6, offsetof(layouts::DrawInstance, face)},
                                                    {7, offsetof(layouts::DrawInstance, first_triangle)}};
    for (const auto& [index, offset] : whole) {
        glEnableVertexArrayAttrib(id, index);
        glVertexArrayAttribIFormat(id, index, 1, GL_UNSIGNED_INT, static_cast<GLuint>(offset));
        glVertexArrayAttribBinding(id, index, 1);
    }
    glVertexArrayBindingDivisor(id, 1, 1);
    if (!colors.empty()) {
        colors.resize(vertices.size(), glm::u16vec4(65535));
        made->colors = gl::make_buffer("vertex colours", colors.size() * sizeof(glm::u16vec4), colors.data());
        glVertexArrayVertexBuffer(id, 2, made->colors.id(), 0, sizeof(glm::u16vec4));
        glEnableVertexArrayAttrib(id, 8);
        glVertexArrayAttribFormat(id, 8, 4, GL_UNSIGNED_SHORT, GL_TRUE, 0);
        glVertexArrayAttribBinding(id, 8, 2);
    }
    if (!tangents.empty()) {
        tangents.resize(vertices.size());
        made->tangents = gl::make_buffer("tangents", tangents.size() * sizeof(glm::vec4), tangents.data());
        glVertexArrayVertexBuffer(id, 3, made->tangents.id(), 0, sizeof(glm::vec4));
        glEnableVertexArrayAttrib(id, 9);
        glVertexArrayAttribFormat(id, 9, 4, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(id, 9, 3);
    }

    for (std::size_t i = 0; i < asset_->images.size(); ++i)
        made->images.push_back(upload_image(asset_->images[i], static_cast<int>(i)));
    constexpr GLint kWraps[] = {GL_CLAMP_TO_EDGE, GL_REPEAT, GL_MIRRORED_REPEAT};  // by Wrap
    for (int i = 0; i < 9; ++i) {
        GLuint sampler = 0;
        glCreateSamplers(1, &sampler);
        made->samplers[i] = gl::Sampler(sampler);
        glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, kWraps[i % 3]);
        glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, kWraps[i / 3]);
    }
    uploaded_ = std::move(made);
    return *uploaded_;
}

namespace {

constexpr GLuint kMostBuffers = 5;  // of a G-buffer: normal, albedo and what else there is

// From now on what is drawn before the G-buffer's surfaces is multiplied into their albedo, and into the emission where
// the program writes it.
void begin_tints(bool emissive) {
    glDepthMask(GL_FALSE);
    for (GLuint buffer = 0; buffer < kMostBuffers; ++buffer) {
        const bool color = buffer == 1 || (buffer == 2 && emissive);
        glColorMaski(buffer, color, color, color, GL_FALSE);
    }
    for (const GLuint buffer : {1u, 2u}) {
        glEnablei(GL_BLEND, buffer);
        glBlendFunci(buffer, GL_ZERO, GL_SRC_COLOR);
    }
}
void end_tints() {
    for (const GLuint buffer : {1u, 2u}) glDisablei(GL_BLEND, buffer);
    for (GLuint buffer = 0; buffer < kMostBuffers; ++buffer) glColorMaski(buffer, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
}

bool is_cube(GpuScene::Mode mode) {
    return mode >= GpuScene::Mode::shadow;
}

}  // namespace

// Sets program, textures and culling for one mesh. One list of what a material has: cut up it would pass the program
// and its defines around.
void GpuScene::use_material(Mode mode, Programs& programs, const DrawGroup& group, const glm::mat4& clip_from_local,
                            int pane_sample) const {
    const bool cells = mode == Mode::gbuffer_cells, cube = is_cube(mode), tint = mode == Mode::tint;
    const Uploaded& own = uploaded();
    const Material& material = asset_->materials[group.material];
    gl::Defines defines;
    if (cube) defines.emplace_back("CUBE", "1");
    if (material.alpha_mask) defines.emplace_back("MASKED", "1");
    const bool pane = material.transmissive(), transmission_textured = pane && material.transmission_image >= 0,
               cut = material.alpha_mask || pane;
    if (pane) defines.emplace_back("TRANSMISSIVE", "1");
    if (transmission_textured) defines.emplace_back("TRANSMISSION_TEXTURED", "1");
    const bool textured = material.base_color_image >= 0 && (mode != Mode::shadow || cut);
    if (textured) defines.emplace_back("TEXTURED", "1");
    if (group.colored && (mode != Mode::shadow || cut)) defines.emplace_back("VERTEX_COLORS", "1");
    std::string_view fragment = "passes/gbuffer.frag";
    if (mode == Mode::shadow) {
        fragment = cut ? "passes/shadow.frag" : "";
    } else if (cube) {
        fragment = "passes/rsm.frag";
        if (mode == Mode::rsm_seed) defines.emplace_back("SEED", "1");
    } else if (emissive_) {
        defines.emplace_back("EMISSIVE", "1");
        if (!tint && material.emissive_image >= 0) defines.emplace_back("EMISSIVE_TEXTURED", "1");
        if (!tint && material.show_back && !material.double_sided) defines.emplace_back("DARK_BACK", "1");
    }
    if (cells) defines.emplace_back("CELLS", emissive_ ? "3" : "2");
    if (cells && !places_.empty()) defines.emplace_back("BODY", "1");
    if (tint) fragment = "passes/tint.frag";
    const bool mapped = !cube && !tint && group.mapped;
    if (!cube && !tint && detailed_)
        defines.emplace_back("DETAIL", std::to_string(2 + (emissive_ ? 1 : 0) + (cells ? 1 : 0)));
    if (mapped) defines.emplace_back("NORMAL_MAP", "1");
    const GLuint program = programs.get("passes/mesh.vert", fragment, defines);
    glUseProgram(program);
    if (cube)
        glProgramUniform1f(program, 1, near_m_);
    else
        glProgramUniformMatrix4fv(program, 0, 1, GL_FALSE, &clip_from_local[0][0]);
    if (!fragment.empty()) {
        glProgramUniform4fv(program, 2, 1, &material.base_color[0]);
        if (material.alpha_mask) glProgramUniform1f(program, 4, material.alpha_cutoff);
        if (!cube && !tint && emissive_) glProgramUniform3fv(program, 3, 1, &material.emissive_nit[0]);
        if (pane) glProgramUniform2f(program, 7, material.transmission, material.alpha_blend ? 1.0f : 0.0f);
        if (pane) glProgramUniform1i(program, 8, pane_sample);
        if (mapped) glProgramUniform1f(program, 5, material.normal_scale);
        if (cells && places_.empty())
            glProgramUniform2ui(program, 6, group.first_index, static_cast<GLuint>(group.base_vertex));
    }
    const GLuint sampler = own.samplers[static_cast<int>(material.wrap_s) + 3 * static_cast<int>(material.wrap_t)].id();
    if (textured) {
        glBindTextureUnit(0, own.images[material.base_color_image].id());
        glBindSampler(0, sampler);
    }
    if (!cube && !tint && material.emissive_image >= 0) {
        glBindTextureUnit(1, own.images[material.emissive_image].id());
        glBindSampler(1, sampler);
    }
    if (transmission_textured) {
        glBindTextureUnit(3, own.images[material.transmission_image].id());
        glBindSampler(3, sampler);
    }
    if (mapped) {
        glBindTextureUnit(2, own.images[material.normal_image].id());
        glBindSampler(2, sampler);
    }
    // glTF culls the back of single-sided faces for the viewer; light is stopped by both sides.
    if (cube || !material.culled_back())
        glDisable(GL_CULL_FACE);
    else
        glEnable(GL_CULL_FACE);
}

PassRun GpuScene::draw(Mode mode, Programs& programs, const glm::dvec3& eye, const glm::mat4& clip_from_local,
                       unsigned faces, int pane_sample) const {
    const bool cells = mode == Mode::gbuffer_cells, cube = is_cube(mode);
    std::array<Planes, 6> planes;
    if (cube) {
        for (int face = 0; face < 6; ++face) planes[face] = face_planes(face);
    } else {
        planes[0] = camera_planes(clip_from_local);
        faces = 1;
    }

    // One instance per (mesh, view or face that it meets), grouped by mesh so that each group is one draw.
    std::vector<layouts::DrawInstance> instances;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ranges(groups_.size());  // first, count
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        ranges[g].first = static_cast<std::uint32_t>(instances.size());
        for (int index : groups_[g].instances) {
            const Bounds& box = bounds_[index];
            if (!places_.empty() && !(box.min.x <= box.max.x)) continue;
            const glm::dvec3 centre = (box.min + box.max) * 0.5 - eye, half = (box.max - box.min) * 0.5;
            glm::dmat4 rebased = places_.empty() ? asset_->instances[index].world_from_mesh : places_[index];
            rebased[3] -= glm::dvec4(eye, 0.0);  // in double
            const glm::mat4 rows = glm::mat4(glm::transpose(rebased));
            for (unsigned face = 0; face < 6; ++face) {
                if ((faces >> face & 1u) == 0 || !meets(planes[face], centre, half)) continue;
                instances.push_back({rows[0], rows[1], rows[2], face, first_triangle_[index], 0, 0});
            }
        }
        ranges[g].second = static_cast<std::uint32_t>(instances.size()) - ranges[g].first;
    }
    PassRun run;
    run.faces = cube ? static_cast<unsigned>(std::popcount(faces & 63u)) : 0;
    if (instances.empty()) return run;

    const Uploaded& own = uploaded();
    const gl::Buffer instance_buffer =
        gl::make_buffer("draw instances", instances.size() * sizeof(layouts::DrawInstance), instances.data());
    glVertexArrayVertexBuffer(own.vertex_array.id(), 1, instance_buffer.id(), 0, sizeof(layouts::DrawInstance));
    glBindVertexArray(own.vertex_array.id());
    if (cells && places_.empty()) {
        static_assert(sizeof(Vertex) == sizeof(layouts::MeshVertex) && offsetof(Vertex, position) == 0);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, own.vertices.id());
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, own.indices.id());
    }
    const auto draw_group = [&](std::size_t g, Mode as) {
        if (ranges[g].second == 0 || groups_[g].index_count == 0) return;
        use_material(as, programs, groups_[g], clip_from_local, pane_sample);
        glDrawElementsInstancedBaseVertexBaseInstance(
            GL_TRIANGLES, groups_[g].index_count, GL_UNSIGNED_INT,
            // NOLINTNEXTLINE(performance-no-int-to-ptr): GL takes an offset for a pointer
            reinterpret_cast<const void*>(static_cast<std::uintptr_t>(groups_[g].first_index) * 4), ranges[g].second,
            groups_[g].base_vertex, ranges[g].first);
        ++run.draws;
    };
    for (std::size_t g = 0; g < groups_.size(); ++g) draw_group(g, mode);
    if (!cube && transmissive_ && places_.empty()) {
        begin_tints(emissive_);
        for (std::size_t g = 0; g < groups_.size(); ++g) {
            if (asset_->materials[groups_[g].material].transmissive()) draw_group(g, Mode::tint);
        }
        end_tints();
    }
    for (GLuint unit = 0; unit < 4; ++unit) glBindSampler(unit, 0);
    glDisable(GL_CULL_FACE);
    return run;
}

}  // namespace gonio
