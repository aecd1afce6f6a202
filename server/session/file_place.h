// Positions between a scene that was brought near the origin and its clients, who know them as the scene's file has
// them. The scene, consoles and saved shows keep positions relative to SceneAsset::place; all messages of clients have
// those of the file.
#pragma once

#include <mutex>
#include <span>
#include <string_view>

#include <glm/vec3.hpp>

#include "protocol/schema/messages.h"

namespace google::protobuf {
class Message;
}

namespace gonio {

// Result: the full names of all fields that hold positions, three numbers each.
std::span<const std::string_view> position_fields();

// Adds a place to all positions of a message and of the messages in it. Fields whose numbers are no whole positions
// stay as they are, so that whoever checks them sees what was sent.
void add_place(google::protobuf::Message& message, const glm::dvec3& place);

// The place of the scene that is shown. Written by the render thread; read by threads that answer clients.
class FilePlace {
public:
    void set(const glm::dvec3& place) {
        const std::lock_guard lock(mutex_);
        place_ = place;
    }
    glm::dvec3 get() const {
        const std::lock_guard lock(mutex_);
        return place_;
    }

private:
    mutable std::mutex mutex_;
    glm::dvec3 place_{0.0};
};

}  // namespace gonio
