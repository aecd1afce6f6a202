// The indirect light of the live picture where shaders make it: irradiance at the surfels goes up, each pixel blends
// that of those around it; nothing is read back.
#include <algorithm>
#include <glm/gtc/packing.hpp>

#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"
#include "server/scene/scene.h"
#include "shaders/shared/layouts.h"

namespace gonio {
namespace {

constexpr float kGreatestHalf = 65504.0f;
static_assert(GONIO_AROUND == transport::kNeighbours && sizeof(layouts::CellTriangle) == sizeof(glm::uvec2));

// Brings the surfels and cells of the transport to the GPU, where they are not there yet.
void upload_surfels(const PassContext& context, OnGpu& own) {
    const transport::Transport& transport = *context.transport;
    const transport::Surfels& surfels = transport.surface->surfels;
    if (own.surface != transport.surface || (context.bodies != nullptr && !own.bodies)) {
        own.surface = transport.surface;
        std::vector<layouts::SurfelDisc> discs;
        for (std::size_t i = 0; i < surfels.count; ++i)
            discs.push_back({glm::vec4(surfels.position(i), 0.0f), glm::vec4(surfels.normal(i), 0.0f)});
        discs.push_back({glm::vec4(0.0f), glm::vec4(0.0f)});
        own.surfels = gl::make_buffer("surfels", discs.size() * sizeof discs[0], discs.data());
        auto around = surfels.neighbours;
        if (context.bodies != nullptr)
            for (std::size_t part = 0; part < context.bodies->sides().parts(); ++part)
                around.push_back(context.bodies->sides().around(part));
        own.bodies = around.size() > surfels.count;
        own.around = gl::make_buffer("surfels around", around.size() * sizeof(around[0]), around.data());
    }
    if (own.cells != transport.cells) {
        own.cells = transport.cells;
        const auto& [triangles, cells] = *transport.cells;
        own.triangle_buffer =
            gl::make_buffer("triangles of cells", triangles.size() * sizeof(layouts::CellTriangle), triangles.data());
        own.cell_buffer = gl::make_buffer("cells", cells.size() * sizeof(std::uint16_t), cells.data());
    }
}

// Draws what the pixels see of the light of the surfels. unit: of the table's values in the layer's. add: to what is
// there.
void draw_irradiance(const PassContext& context, const OnGpu& on_gpu, GLuint framebuffer, const transport::Table& table,
                     float unit, bool add) {
    const Target& target = context.target;
    const gl::Buffer irradiance =
        gl::make_buffer("irradiance", table.halves.size() * sizeof(std::uint16_t), table.halves.data());
    const GLuint program = context.programs.get("passes/screen.vert", "passes/gather.frag");
    begin_screen(context.programs, framebuffer, program, target.width_px, target.height_px);
    glProgramUniform1f(program, 1, unit);
    glProgramUniform1f(program, 2, kGreatestHalf);
    glBindTextureUnit(0, target.weights.id());
    glBindTextureUnit(1, target.surfel.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 5, on_gpu.around.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 6, irradiance.id());
    if (add) glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    draw_screen();
    glDisable(GL_BLEND);
}

}  // namespace

PassRun run_gather_weights_gl(const PassContext& context, OnGpu& own) {
    if (!context.has_surfels()) return {};
    if (context.bodies != nullptr) context.bodies->find_sides(context.transport->surface, context.pool);
    upload_surfels(context, own);
    const Target& target = context.target;
    const transport::Surfels& surfels = context.transport->surface->surfels;
    const GLuint program = context.programs.get("passes/screen.vert", "passes/gather_weights.frag");
    begin_screen(context.programs, target.weights_fbo.id(), program, target.width_px, target.height_px);
    bind_surface(program, context, context.traced.origin());  // local positions
    glProgramUniform1ui(program, 1, static_cast<GLuint>(surfels.count));
    const float reach_m = transport::kBlendRadii * surfels.radius_m;
    glProgramUniform1f(program, 2, 1.0f / (reach_m * reach_m));
    glBindTextureUnit(10, target.cell.id());
    const GLuint buffers[] = {own.triangle_buffer.id(), own.cell_buffer.id(), own.surfels.id(), own.around.id()};
    for (GLuint i = 0; i < 4; ++i) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2 + i, buffers[i]);
    draw_screen();
    return {0, 1};
}

PassRun run_gather_gl(const PassContext& context, const LightGpu& gpu, int layer, const OnGpu& on_gpu) {
    const GLuint framebuffer = layer_framebuffer(context.target, context.target.indirect.id(), layer);
    transport::Table table;
    const std::vector<glm::vec4>& indirect = gpu.irradiance.indirect;
    if (shows_bodies(context) && !indirect.empty())
        transport::make_table(at_bodies(context, indirect, gpu.irradiance, true), table, context.pool);
    else if (context.has_surfels())
        transport::make_table(indirect, table, context.pool);
    if (!(table.unit > 0.0f)) {
        const float black[4] = {};
        glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, black);
        return {};
    }
    draw_irradiance(context, on_gpu, framebuffer, table, table.unit, false);
    return {0, 1};
}

PassRun run_besides(const PassContext& context, const lighting::GBuffer& s, const PixelLight& light,
                    const OnGpu& on_gpu, std::array<float, 2>& units_lx) {
    const auto master = static_cast<float>(context.scene.master_ratio);
    units_lx = {};
    const transport::Irradiance none, &emitted = context.has_surfels() ? context.transport->emitted : none;
    PassRun run;
    for (const int part : {0, 1}) {
        std::vector<float> sum;
        float greatest_lx = 0.0f;
        // At the pixels; unit_lx: of their values.
        struct Stored {
            const Besides* besides;
            float unit_lx;
        };
        std::vector<Stored> stored;
        // By shaders; unit_lx: of the table's values.
        struct Drawn {
            transport::Table table;
            float unit_lx;
        };
        std::vector<Drawn> drawn;
        const auto draw = [&](const transport::Irradiance& light_of, float unit_lx) {
            Drawn one;
            const std::vector<glm::vec4>& at_surfels = part == 0 ? light_of.direct : light_of.indirect;
            if (!shows_bodies(context) || at_surfels.empty())
                transport::make_table(at_surfels, one.table, context.pool);
            else if (part == 0)
                transport::make_table(context.bodies->sides().with_emitted(at_surfels), one.table, context.pool);
            else
                transport::make_table(at_bodies(context, at_surfels, light_of, true), one.table, context.pool);
            one.unit_lx = one.table.unit * unit_lx;
            if (!(one.unit_lx > 0.0f)) return;
            greatest_lx += 1000.0f * one.unit_lx;  // of a table, and so of what is blended from it
            drawn.push_back(std::move(one));
        };
        const auto add = [&](const Besides& besides, float gain, const transport::Irradiance& irradiance,
                             float unit_lx) {
            const std::vector<std::uint16_t>& pixels = besides.pixels[part];
            if (!(besides.unit_lx[part] > 0.0f)) return;
            if (context.gathers && pixels.empty()) {
                draw(irradiance, unit_lx);
                return;
            }
            if (gain > 0.0f) stored.push_back({&besides, gain * besides.unit_lx[part]});
        };
        if (!context.scene.emission_hidden) add(light.emitted, 1.0f, emitted, 1.0f);
        add(light.summed, master, light.summed_list.irradiance, master * light.summed.unit_lx[1]);
        if (context.merged && part == 1)
            draw(light.merged.irradiance, light.merged.reference / context.geometry.layer_unit_m2());
        if (stored.size() == 1 && drawn.empty() && stored[0].besides->precise[part].empty()) {  // as it is
            units_lx[part] = stored[0].unit_lx;
            upload(context.target.besides, s, part, GL_RGBA, GL_HALF_FLOAT, stored[0].besides->pixels[part].data());
            continue;
        }
        constexpr std::size_t kChunk = 1 << 16;  // a multiple of 4
        for (const Stored& one : stored) {
            const std::vector<std::uint16_t>& pixels = one.besides->pixels[part];
            const std::vector<float>& precise = one.besides->precise[part];
            sum.resize(std::max(pixels.size(), precise.size()), 0.0f);
            greatest_lx += context.pool.reduce_chunks(
                sum.size(), kChunk, 0.0f,
                [&](std::size_t first, std::size_t count) {
                    float greatest = 0.0f;
                    for (std::size_t i = first; i < first + count; ++i) {
                        const float value =
                            one.unit_lx * (precise.empty() ? glm::unpackHalf1x16(pixels[i]) : precise[i]);
                        sum[i] += value;
                        if (i % 4 != 3) greatest = std::max(greatest, std::abs(value));
                    }
                    return greatest;
                },
                [](float a, float b) { return std::max(a, b); });
        }
        if (!(greatest_lx > 0.0f)) continue;
        const float unit_lx = units_lx[part] = greatest_lx / 1000.0f;  // halves hold the rest to 2^-24
        const GLuint framebuffer = layer_framebuffer(context.target, context.target.besides.id(), part);
        if (sum.empty()) {
            const float black[4] = {};
            glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, black);
        } else {
            context.pool.run_chunks(sum.size(), kChunk, [&](std::size_t first, std::size_t count) {
                for (std::size_t i = first; i < first + count; ++i) sum[i] /= unit_lx;
            });
            upload(context.target.besides, s, part, GL_RGBA, GL_FLOAT, sum.data());
        }
        for (const Drawn& one : drawn) {
            draw_irradiance(context, on_gpu, framebuffer, one.table, one.unit_lx / unit_lx, true);
            ++run.draws;
        }
    }
    return run;
}

}  // namespace gonio
