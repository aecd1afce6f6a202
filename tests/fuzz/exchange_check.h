// What the readers of other programs' files promise, whatever the bytes. Shared by the fuzz targets and their replay
// test.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "server/exchange/beam_web.h"
#include "server/exchange/gdtf_dmx.h"
#include "server/exchange/mesh_3ds.h"
#include "server/exchange/mvr.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_finite(const glm::dmat4& matrix) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) require(std::isfinite(matrix[column][row]));
}

inline bool in(int index, std::size_t size) {
    return index >= -1 && index < static_cast<int>(size);
}

inline void check_mode(const gdtf::FixtureType& type, const gdtf::Mode& mode) {
    for (std::size_t i = 0; i < mode.geometries.size(); ++i) {
        const gdtf::Geometry& one = mode.geometries[i];
        require(one.parent < static_cast<int>(i) && in(one.reference, i + 1) && in(one.model, type.models.size()));
        check_finite(one.parent_from_geometry);
        if (!one.beam) continue;
        const auto web = gdtf::beam_web(*one.beam);
        for (const float candela : web.candela) require(candela >= 0.0f && candela <= 1e12f);
        for (std::size_t v = 1; v < web.v_rad.size(); ++v) require(web.v_rad[v - 1] < web.v_rad[v]);
    }
    for (const gdtf::Channel& channel : mode.channels)
        for (const gdtf::ChannelFunction& function : channel.functions)
            require(function.from <= function.to && function.to <= gdtf::greatest_of(channel.bytes) &&
                    in(function.wheel, type.wheels.size()) && in(function.master, mode.channels.size()));
    for (const gdtf::PatchedChannel& one : mode.patched)
        for (const int slot : one.slots) require(slot >= 1 && slot <= mode.footprint.at(one.dmx_break));
    for (const std::uint8_t level : {0, 127, 255}) {
        gdtf::DmxBytes bytes;
        for (const auto& [dmx_break, slots] : mode.footprint) bytes[dmx_break].assign(512, level);
        for (const gdtf::BeamState& state : gdtf::beam_states(type, mode, gdtf::channel_values(type, mode, bytes))) {
            check_finite(state.fixture_from_beam);
            require(state.dimmer_ratio >= 0.0 && state.dimmer_ratio <= 1.0);
            for (int i = 0; i < 3; ++i) require(std::isfinite(state.color[i]) && state.color[i] >= 0.0);
        }
    }
}

inline void check_gdtf(std::string_view bytes) {
    static const std::string entries[] = {"wheels/Stars.png", "models/3ds/Body.3ds"};
    const auto type = gdtf::read_description(bytes, entries);
    if (!type) return check_refusal(type.error());
    require(!type->modes.empty() && type->report.notes.size() <= exchange::kMaxNotes);
    for (const gdtf::Mode& mode : type->modes) check_mode(*type, mode);
}

inline void check_mvr(std::string_view bytes) {
    static const std::string entries[] = {"Maker@Type.gdtf", "leg.3ds", "desk.glb"};
    const auto show = mvr::read_show(bytes, entries);
    if (!show) return check_refusal(show.error());
    require(show->report.notes.size() <= exchange::kMaxNotes && show->objects.size() <= mvr::kMaxObjects);
    for (std::size_t i = 0; i < show->objects.size(); ++i) {
        const mvr::Object& one = show->objects[i];
        require(one.parent < static_cast<int>(i) && in(one.layer, show->layers.size()) &&
                in(one.object_class, show->classes.size()));
        for (int column = 0; column < 3; ++column) require(!std::isnan(one.world_from_object[column][column]));
    }
    for (const mvr::Fixture& fixture : show->fixtures) {
        require(in(fixture.focus, show->focus_points.size()));
        for (const mvr::Patch& patch : fixture.patches)
            require(patch.dmx_break >= 1 && patch.universe >= 1 && patch.address >= 1 && patch.address <= 512);
    }
    require(!exchange::report_lines(show->report).empty() || show->report.notes.empty());
}

inline void check_3ds(std::string_view bytes) {
    const auto mesh = exchange::read_3ds(bytes);
    if (!mesh) return check_refusal(mesh.error());
    for (const exchange::Mesh3ds::Part& part : mesh->parts) {
        require(in(part.material, mesh->materials.size()) && part.positions.size() % 3 == 0);
        for (const glm::vec3& position : part.positions)
            for (int i = 0; i < 3; ++i) {
                const auto at = static_cast<double>(position[i]);
                require(at >= mesh->least[i] && at <= mesh->most[i]);
            }
    }
}

}  // namespace gonio::fuzz
