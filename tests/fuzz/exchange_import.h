// What the import of a show promises, whatever its description says. Shared by the fuzz target and its replay test.
#pragma once

#include <vector>

#include "protocol/schema/gonio.pb.h"
#include "server/exchange/import_mvr.h"
#include "tests/fuzz/exchange_check.h"

namespace gonio::fuzz {

// The text as the description of a show whose files are always the same.
inline void check_import(std::string_view text) {
    static const std::string type = *write_zip(std::vector<ZipFile>{
        {"description.xml",
         "<GDTF><FixtureType Name='T'><Geometries><Axis Name='Y'><Axis Name='H'><Beam Name='L' "
         "LuminousFlux='9'/></Axis>"
         "</Axis></Geometries><DMXModes><DMXMode Name='M' Geometry='Y'><DMXChannels><DMXChannel Offset='1,2' "
         "Geometry='Y'>"
         "<LogicalChannel Attribute='Pan'><ChannelFunction Attribute='Pan' PhysicalFrom='-270' PhysicalTo='270'/>"
         "</LogicalChannel></DMXChannel><DMXChannel Offset='3' Geometry='H'><LogicalChannel Attribute='Tilt'>"
         "<ChannelFunction Attribute='Tilt' PhysicalFrom='-130' PhysicalTo='130'/></LogicalChannel></DMXChannel>"
         "<DMXChannel Offset='4' Geometry='L'><LogicalChannel Attribute='Dimmer'><ChannelFunction Attribute='Dimmer'/>"
         "</LogicalChannel></DMXChannel></DMXChannels></DMXMode></DMXModes></FixtureType></GDTF>"}});
    const auto bytes = write_zip(std::vector<ZipFile>{{"GeneralSceneDescription.xml", std::string(text), false},
                                                      {"Maker@Type.gdtf", type, false},
                                                      {"leg.3ds", "MM", false}});
    require(static_cast<bool>(bytes));
    const auto scene = exchange::import_mvr(*bytes, "show", {}, std::size_t{1} << 27);
    if (!scene) return check_refusal(scene.error());
    require(!(*scene)->materials.empty() && (*scene)->warnings.size() <= 100);
    for (const LightSeed& light : (*scene)->lights) {
        require(!light.name.empty() && light.profile != nullptr);
        for (int i = 0; i < 3; ++i) require(std::isfinite(light.position[i]) && light.color[i] >= 0.0);
        require(std::abs(glm::length(light.world_from_light) - 1.0) < 1e-6);
    }
    if ((*scene)->patch)
        for (const v1::PatchRow& row : (*scene)->patch->rows())
            require(row.address() >= 1 && row.address() <= 512 && row.universe() >= 1);
}

}  // namespace gonio::fuzz
