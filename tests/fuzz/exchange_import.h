// What the import of a show promises, whatever its description says. Shared by the fuzz target and its replay test.
#pragma once

#include <fstream>
#include <iterator>
#include <vector>

#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/exchange/import_mvr.h"
#include "server/scene/apply.h"
#include "server/scene/body.h"
#include "server/scene/console.h"
#include "server/scene/scene.h"
#include "tests/fuzz/exchange_check.h"

namespace gonio::fuzz {

inline void check_scene(const SceneAsset& scene) {
    require(!scene.materials.empty() && scene.warnings.size() <= 100);
    for (const LightSeed& light : scene.lights) {
        require(!light.name.empty() && light.profile != nullptr);
        for (int i = 0; i < 3; ++i) require(std::isfinite(light.position[i]) && light.color[i] >= 0.0);
        require(std::abs(glm::length(light.world_from_light) - 1.0) < 1e-6);
    }
    if (scene.patch) require(static_cast<bool>(check_patch(*scene.patch)));
}

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
    check_scene(**scene);
}

inline std::string corpus_file(const char* name) {
    std::ifstream file(std::string(GONIO_SOURCE_DIR "/tests/fuzz/") + name, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    require(!bytes.empty());
    return bytes;
}

// What is seen of the lights and their bodies.
inline void check_lights(const Scene& scene) {
    for (const Light& light : scene.lights) {
        const glm::dquat& turn = light.world_from_light;
        require(std::abs(glm::length(turn) - 1.0) < 1e-6 && std::isfinite(light.pan_rad + light.tilt_rad));
        require(light.level_ratio >= 0.0 && light.level_ratio <= 1.0);
        require(std::isfinite(light.shining()->flux_lm) && light.shining()->flux_lm >= 0.0);
    }
    for (const auto& place : body_places(scene))
        if (place) check_finite(*place);
}

// The text as the description of the fixture type of a show, with a gobo and models, and a console that drives it.
inline void check_fixture_type(std::string_view text) {
    static const std::string gobo = corpus_file("asset_corpus/image.png"),
                             model = corpus_file("asset_corpus/scene.glb"),
                             mesh = corpus_file("exchange_corpus/square.3ds");
    static const std::string show =
        "<GeneralSceneDescription verMajor='1' verMinor='6'><Scene><Layers><Layer name='L'><ChildList>"
        "<FocusPoint name='F' uuid='f'><Matrix>{1,0,0}{0,1,0}{0,0,1}{4000,2000,500}</Matrix></FocusPoint>"
        "<Fixture name='A'><GDTFSpec>Maker@Type</GDTFSpec><Addresses><Address break='0'>1.1</Address></Addresses>"
        "</Fixture><Fixture name='B'><Matrix>{0,0,-1}{0,1,0}{1,0,0}{0,0,0}</Matrix><GDTFSpec>Maker@Type</GDTFSpec>"
        "<Focus>f</Focus><Addresses><Address break='0'>1.1</Address></Addresses><DMXInvertPan>true</DMXInvertPan>"
        "</Fixture></ChildList></Layer></Layers></Scene></GeneralSceneDescription>";
    const auto type = write_zip(std::vector<ZipFile>{{"description.xml", std::string(text), false},
                                                     {"wheels/Stars.png", gobo, false},
                                                     {"models/3ds/Body.3ds", mesh, false},
                                                     {"models/gltf/Yoke.glb", model, false}});
    require(static_cast<bool>(type));
    const auto bytes = write_zip(
        std::vector<ZipFile>{{"GeneralSceneDescription.xml", show, false}, {"Maker@Type.gdtf", *type, false}});
    require(static_cast<bool>(bytes));
    const auto asset = exchange::import_mvr(*bytes, "show", {}, std::size_t{1} << 27);
    if (!asset) return check_refusal(asset.error());
    check_scene(**asset);
    Scene scene = scene_of(*asset);
    check_lights(scene);
    for (const std::uint8_t level : {0, 100, 255}) {
        DmxUniverse universe;
        DmxSource& source = universe.sources.emplace_back();
        source.id = 1;
        source.rank.fill(101);
        source.levels.fill(level);
        PatchReader reader(patch_in_force(scene));
        const auto values = reader.read({DmxProtocol::sacn, 1}, universe);
        for (const auto& refused : apply_inputs(scene, commands_of(scene, values)))
            if (refused) check_refusal(*refused);
        check_lights(scene);
    }
}

}  // namespace gonio::fuzz
