// What can be undone and redone, as plain data: server/session/undo.h keeps it, server/show/undo_file.h puts it on the
// disk. Steps and scenes that were left are never changed, only replaced, so that threads can share them.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/scene/edit.h"

namespace gonio {

namespace saved {
class UndoLeft;
}  // namespace saved

struct UndoEdit {
    EditValue before, after;
    std::uint64_t before_writer = 0;
    bool undone = false;
};

struct UndoStep {
    std::uint64_t id = 0;
    std::uint32_t session = 0, gesture = 0;
    std::string label;
    std::map<EditKey, UndoEdit> edits;
    std::size_t bytes = 0;
};

struct UndoStack {
    std::deque<std::shared_ptr<const UndoStep>> steps;
    std::size_t done = 0;  // the steps before it can be undone, the others redone
    std::uint64_t used = 0;
};

// Who wrote a property last that a step knows.
struct UndoWriter {
    std::uint64_t step = 0;  // or a number of its own, of a writer that has no step
    bool input = false;      // a console or a fader box
    std::size_t uses = 0;    // steps that know the property
    EditValue now;
};

// Whether the steps of a key end with their connection: it is of a client that named none.
inline bool ends_with_session(const std::string& key) {
    return key.starts_with("session ");
}

// Everybody's steps in one scene.
struct UndoSteps {
    std::map<std::string, UndoStack> stacks;  // by key
    std::map<EditKey, UndoWriter> writers;
    std::size_t bytes = 0;
};

// A scene that another one took the place of, as it was left, and the steps that were taken in it.
struct LeftScene {
    std::shared_ptr<const Scene> scene;  // null: it is still being read from `kept`
    std::string key, label;              // of whose load it was
    UndoSteps steps;
    std::shared_ptr<const saved::UndoLeft> kept;  // of a scene that the disk had at the start; else null
};

struct UndoRecord {
    UndoSteps steps;  // of the scene as it stands
    std::vector<std::shared_ptr<const LeftScene>> earlier;
    std::uint64_t last_id = 0;
};

}  // namespace gonio
