// What the readers of messages promise, whatever the bytes; and apply(), whatever a client asks. Shared by the fuzz
// targets and their replay test.
#pragma once

#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

#include "protocol/schema/codec.h"
#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_answer(const Error& error) {
    check_refusal(error);
    // What is told to the client must be a message that the client can read.
    v1::ServerMessage message;
    *message.mutable_result() = refusal(error);
    for (const Encoding encoding : {Encoding::proto, Encoding::json})
        require(static_cast<bool>(decode_server_message(encoding, encode_message(encoding, message))));
}

inline const Loaded& some_files() {
    static const Loaded files = [] {
        auto profile = std::make_shared<Profile>();
        profile->name = "one";
        profile->photometry.web = {
            ies::Goniometer::type_c, {0.0, std::numbers::pi}, {0.0, 2 * std::numbers::pi}, {100, 100, 100, 100}};
        profile->peak_cd = 100;
        auto asset = std::make_shared<SceneAsset>();
        asset->name = "some";
        asset->bounds = {{-1, -1, -1}, {1, 1, 1}};
        for (const char* name : {"key", "fill"}) {
            LightSeed light;
            light.name = name;
            light.profile = profile;
            asset->lights.push_back(light);
        }
        return Loaded{asset, profile};
    }();
    return files;
}

// Everything the renderer relies on.
inline void check_scene(const Scene& scene) {
    const auto finite = [](const glm::dvec3& v) {
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    };
    require(scene.asset != nullptr && scene.lights.size() <= kMaxLights && scene.groups.size() <= kMaxGroups &&
            scene.presets.size() <= kMaxPresets && (!scene.cues || scene.cues->size() <= kMaxCues));
    for (const Light& light : scene.lights) {
        require(!light.name.empty() && light.name.size() <= kMaxNameBytes && light.profile != nullptr);
        require(finite(light.position) && finite(light.color) && std::isfinite(light.multiplier));
        require(light.level_ratio >= 0 && std::isfinite(light.level_ratio));
        const glm::dquat& q = light.world_from_light;
        require(std::abs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 1e-6);
    }
    require(finite(scene.camera.eye) && finite(scene.camera.target) && scene.camera.eye != scene.camera.target);
    require(scene.camera.fov_rad > 0 && scene.camera.fov_rad < std::numbers::pi);
    require(std::isfinite(scene.exposure_ev100) && std::isfinite(scene.master_ratio) && std::isfinite(scene.view_gain));
    require(scene.width_px >= 16 && scene.width_px <= 4096 && scene.width_px % 2 == 0);
    require(scene.height_px >= 16 && scene.height_px <= 4096 && scene.height_px % 2 == 0);
    require(scene.samples >= 1 && scene.samples <= 4096);
}

inline void check_command(const v1::Command& command) {
    Scene scene = scene_of(some_files().asset, 10);
    const std::string before = full_state(scene).SerializeAsString();
    for (int twice = 0; twice < 2; ++twice) {
        const Revision rev = scene.scene_rev;
        const auto applied = apply(scene, command, some_files());
        if (!applied) {
            check_answer(applied.error());
            if (twice == 0) require(full_state(scene).SerializeAsString() == before && scene.scene_rev == rev);
            break;
        }
        require(applied->scene_rev == scene.scene_rev && scene.scene_rev >= rev);
    }
    check_scene(scene);
    v1::ServerMessage told;
    *told.mutable_state() = full_state(scene);
    for (const Encoding encoding : {Encoding::proto, Encoding::json})
        require(static_cast<bool>(decode_server_message(encoding, encode_message(encoding, told))));
}

// What a client sends.
inline void check_client_message(Encoding encoding, std::string_view bytes) {
    peek_request_id(encoding, bytes);
    const auto message = decode_client_message(encoding, bytes);
    if (!message) return check_answer(message.error());
    // Either encoding carries it on unchanged.
    for (const Encoding other : {Encoding::proto, Encoding::json}) {
        const auto again = decode_client_message(other, encode_message(other, *message));
        require(again && again->request_id() == message->request_id() &&
                again->message_case() == message->message_case());
    }
    if (message->has_command()) check_command(message->command());
}

// What a client hears: the first byte chooses.
inline void check_server_bytes(std::string_view bytes) {
    if (bytes.empty()) return;
    const std::string_view rest = bytes.substr(1);
    if (bytes[0] == '{') {
        if (const auto message = decode_server_message(Encoding::json, bytes))
            require(static_cast<bool>(decode_server_message(Encoding::json, encode_message(Encoding::json, *message))));
    } else if (bytes[0] == static_cast<char>(kBinaryControl)) {
        if (const auto message = decode_server_message(Encoding::proto, rest))
            require(
                static_cast<bool>(decode_server_message(Encoding::proto, encode_message(Encoding::proto, *message))));
    } else {
        const auto header = decode_frame_header(std::as_bytes(std::span(bytes.data(), bytes.size())));
        if (!header) return require(!header.error().code.empty() && !header.error().where.empty());
        require(bytes.size() >= kFrameHeaderBytes);
        const auto again = decode_frame_header(encode_frame_header(*header));
        require(again && again->seq == header->seq && again->scene_rev == header->scene_rev &&
                again->key == header->key && again->final == header->final &&
                again->rendered_ns == header->rendered_ns);
    }
}

}  // namespace gonio::fuzz
