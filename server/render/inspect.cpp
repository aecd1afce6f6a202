#include "server/render/inspect.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

struct Reader {
    const FrameInputs& inputs;
    Inspected item;
    const Inspector& visit;

    void values(const char* name, int channels, bool has_sign, std::span<const float> values) {
        item.name = name;
        item.channels = channels;
        item.has_sign = has_sign;
        item.values = values;
        visit(item);
    }

    // layer: of an array; -1: the whole texture, all six faces of a cube.
    // unit: what its values are to be divided by.
    void texture(const char* name, const gl::Texture& texture, int channels, bool has_sign = false, int layer = -1,
                 float unit = 1.0f) {
        if (!texture) return;
        GLint target = 0, width = 0, height = 0, depth = 1;
        glGetTextureParameteriv(texture.id(), GL_TEXTURE_TARGET, &target);
        glGetTextureLevelParameteriv(texture.id(), 0, GL_TEXTURE_WIDTH, &width);
        glGetTextureLevelParameteriv(texture.id(), 0, GL_TEXTURE_HEIGHT, &height);
        GLint format = 0;
        glGetTextureLevelParameteriv(texture.id(), 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
        if (target == GL_TEXTURE_CUBE_MAP) depth = 6;
        const GLenum read = format == GL_DEPTH_COMPONENT32F ? GL_DEPTH_COMPONENT
                            : channels == 1                 ? GL_RED
                            : channels == 2                 ? GL_RG
                                                            : GL_RGBA;
        std::vector<float> read_back(std::size_t{1} * width * height * depth * channels);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glGetTextureSubImage(texture.id(), 0, 0, 0, std::max(layer, 0), width, height, depth, read, GL_FLOAT,
                             static_cast<GLsizei>(read_back.size() * sizeof(float)), read_back.data());
        for (float& value : read_back) value /= unit;
        item.half_float = format == GL_R16F || format == GL_RGBA16F;
        values(name, channels, has_sign, read_back);
        item.half_float = false;
    }

    // What all luminaires' passes made at once, lux.
    void merged(const char* name, bool indirect) {
        std::vector<float> flat;
        for (const glm::vec3& lux :
             cpu_illuminance(inputs.context(), {}, indirect, inputs.screen.surfaces, inputs.screen.light))
            flat.insert(flat.end(), {lux.x, lux.y, lux.z});
        item.half_float = true;
        values(name, 3, false, flat);
        item.half_float = false;
    }
};

}  // namespace

// One switch over the slots: cut up it would be two.
void inspect_slot(const FrameInputs& inputs, const SlotRef& slot, const Inspector& visit) {
    Reader read{inputs, {inputs.scene, nullptr, nullptr, slot, "", 4, false, false, {}}, visit};
    const Target& target = inputs.target;
    int layer = -1;
    for (std::size_t i = 0; i < inputs.lights.size(); ++i) {
        if (inputs.scene.lights[i].id != slot.light) continue;
        read.item.light = &inputs.scene.lights[i];
        read.item.maps = inputs.lights[i];
        layer = inputs.layers[i];
    }
    const LightGpu* light = read.item.maps;
    switch (slot.slot) {
        case Slot::gbuffer:
            read.texture("depth", target.depth, 1);
            read.texture("normal", target.normal, 2, true);
            read.texture("albedo", target.albedo, 4);
            read.texture("emission", target.emission, 4);
            break;
        case Slot::shadow:
            read.texture("shadow", light->shadow, 1);
            break;
        case Slot::rsm:
            read.texture("radial_depth", light->radial_depth, 1);
            read.texture("normal", light->normal, 2, true);
            read.texture("albedo", light->albedo, 4);
            read.texture("position", light->position, 4, true);
            read.texture("rsm_depth", light->rsm_depth, 1);
            break;
        case Slot::mask:
            read.texture("mask", light->mask, 4);
            break;
        case Slot::flux:
            read.texture("flux", light->flux, 4);
            break;
        case Slot::surfels:
            read.item.unit = inputs.geometry.layer_unit_m2();
            read.values("surfel_direct", 1, false, light->surfel_direct);
            break;
        case Slot::solve: {
            std::vector<float> flat;
            for (const glm::vec4& e : light->irradiance.indirect) flat.insert(flat.end(), &e[0], &e[0] + 3);
            read.values("surfel_indirect", 3, false, flat);
            break;
        }
        case Slot::direct:
        case Slot::gather:
            if (layer < 0) {
                const bool indirect = slot.slot == Slot::gather;
                if (slot.light == 0) read.merged(indirect ? "merged_indirect" : "merged_direct", indirect);
                break;
            }
            if (inputs.shades_on_cpu())
                run_layers(inputs.context(), layer, inputs.screen.surfaces, inputs.screen.light.layers);
            if (slot.slot == Slot::direct)
                read.texture("direct", target.direct, 1, false, layer, inputs.geometry.layer_unit_m2());
            else
                read.texture("indirect", target.indirect, 4, false, layer, inputs.geometry.layer_unit_m2());
            break;
        case Slot::besides:
            for (int part = 0; part < 2; ++part) read.texture("besides", target.besides, 4, false, part);
            break;
        case Slot::emitted:  // of `besides`
            break;
        case Slot::gathered:
            for (std::size_t i = 0; i < inputs.lights.size(); ++i) {
                read.item.light = &inputs.scene.lights[i];
                read.item.maps = inputs.lights[i];
                if (inputs.layers[i] < 0) continue;
                read.texture("indirect", target.indirect, 4, false, inputs.layers[i], inputs.geometry.layer_unit_m2());
            }
            break;
        case Slot::picture:
            if (inputs.raw == 0) read.texture("display", target.display, 4);
            break;
        case Slot::layers:
        case Slot::weights:
        case Slot::weights_gl:
        case Slot::grid:
        case Slot::merged:
        case Slot::merged_solve:
        case Slot::reached:
        case Slot::each_pixel:
        case Slot::gathering:
        case Slot::refined:
        case Slot::edges:
        case Slot::openings:
        case Slot::edge_samples:
        case Slot::distances:
        case Slot::haze_points:
        case Slot::haze_surfels:
        case Slot::probes:
        case Slot::seen_probes:
        case Slot::glow:
        case Slot::air_view:
        case Slot::airlight:
        case Slot::air_picture:
        case Slot::grid_sum:  // the CPU's own; what becomes of them is the gather's layer
            break;
        case Slot::nv12:
            if (const auto& bytes = inputs.screen.composed.nv12) {
                const std::vector<float> values(bytes->begin(), bytes->end());
                read.values("nv12", 1, false, values);
            } else {
                read.texture("nv12", target.nv12, 1);
            }
            break;
    }
}

}  // namespace gonio
