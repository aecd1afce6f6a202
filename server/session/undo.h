// What each client can undo and redo. A step holds, by property, the value before and after a command; it sets back
// those whose last writer it still is. A load is a step too: the scene that it replaced is kept as a whole, with the
// steps that everybody had taken in it. Pure. Render thread.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/session.pb.h"
#include "server/scene/edit.h"
#include "server/scene/undo_record.h"

namespace gonio {

inline constexpr std::size_t kMaxUndoSteps = 100;        // of a key; beyond it the oldest goes
inline constexpr std::size_t kMaxUndoKeys = 64;          // beyond it the one that was not used for longest goes
inline constexpr std::size_t kMaxUndoBytes = 16u << 20;  // of all keys; beyond it the oldest step of all goes
inline constexpr std::size_t kMaxUndoLoads =
    4;  // scenes that are kept for undo, and for redo; beyond it the oldest goes
// Of the meshes and pictures of all of them that the scene does not have itself; beyond it the oldest goes too.
inline constexpr std::size_t kMaxUndoLoadBytes = std::size_t{1} << 30;
inline constexpr std::size_t kMaxUndoWarnings = 16;  // of one answer; the rest is counted

// What an undo or redo is about to do.
struct UndoPlan {
    std::vector<EditTarget> targets;     // for apply(), which says itself what it cannot do
    std::shared_ptr<const Scene> scene;  // that comes back as a whole, instead; null: none
    std::vector<std::string> warnings;   // what stays, because another changed it
    std::uint64_t step = 0;
    std::string label;
};

class Undo {
public:
    explicit Undo(std::size_t most_load_bytes = kMaxUndoLoadBytes) : most_load_bytes_(most_load_bytes) {}
    // undo_key: whose steps the session goes on with; empty: its own. wants: whether it is told of labels.
    void identify(std::uint32_t session, const std::string& undo_key, bool wants);
    void forget_session(std::uint32_t session);

    // A command of a client was applied. Result: the step that it is, 0 where it is none (of a look: camera, view,
    // exposure, size, technique; or without a change) or a load. A recall that fades is a step of all that the fade
    // will change.
    std::uint64_t note(std::uint32_t session, const Scene& before, const Scene& after, const v1::Command& command);
    // A console, a fader box, or a fade of the step changed what it changed after the revision.
    void note_inputs(const Scene& after, Revision since, std::uint64_t fading = 0);

    // Result: what to set back, of the session's last step, or of the last that it undid. Errors: "not_found"; "busy":
    // the scene is still being read.
    Result<UndoPlan> plan(std::uint32_t session, bool redo, const Scene& scene) const;
    // The plan was applied. Result: what it changed, by property; nothing where a scene came back.
    std::vector<Edit> carried_out(std::uint32_t session, bool redo, const UndoPlan& plan, const Scene& before,
                                  const Scene& after);

    // A file of this name holds another scene now: a kept one of the name is not saved any more.
    void note_saved(const std::string& show_name);

    // Result: what a restart needs to go on; without steps of sessions that end with their connection.
    std::shared_ptr<const UndoRecord> record() const;
    // Goes on with what an earlier run left. Before the first command.
    void go_on(const UndoRecord& record, const Scene& scene);
    // A scene of that record was read; null: it could not be, so it goes with those before it.
    void take_read(const std::shared_ptr<const LeftScene>& kept, std::shared_ptr<const LeftScene> read,
                   const Scene& scene);

    // Result: the sessions whose labels are others than they were told, and the labels.
    std::vector<std::pair<std::uint32_t, v1::UndoState>> take_news();
    std::size_t bytes() const { return bytes_; }
    std::size_t keys() const { return stacks_.size(); }
    std::size_t scenes() const { return earlier_.size() + later_.size(); }

private:
    using Step = UndoStep;
    using Stack = UndoStack;
    using Writer = UndoWriter;
    using Left = LeftScene;
    using LeftScenes = std::vector<std::shared_ptr<const Left>>;
    struct Session {
        std::string key;
        bool wants = false;
        v1::UndoState told;
    };
    const Stack* stack_of(std::uint32_t session) const;
    const Left* left_by(std::uint32_t session, const LeftScenes& scenes) const;
    void note_load(std::uint32_t session, const Scene& before, const Scene& after, const v1::Command& command);
    void leave(LeftScenes& to, const Scene& scene, const std::string& key, const std::string& label);
    void keep_load_bounds(const Scene& scene);
    Stack& open_stack(const std::string& key);
    void drop_stack(const std::string& key);
    void drop_step(Stack& stack, std::size_t index);
    void merge(Step& step, std::vector<Edit> edits, const Scene& after);
    void weigh(Step& step);
    void keep_bounds(Stack& stack);
    void write(const EditKey& key, const Scene& scene, std::uint64_t by, bool input);
    bool last_writer(const Step& step, const EditKey& key, bool redo) const;
    bool can_go(const Step& step, std::uint32_t light, bool redo, const Scene& scene) const;

    std::map<std::uint32_t, Session> sessions_;  // as many as the HTTP server lets in
    std::map<std::string, Stack> stacks_;
    std::map<EditKey, Writer> writers_;
    LeftScenes earlier_, later_;  // undo goes back to the last of the earlier ones, redo to the last of the later
    std::uint64_t last_id_ = 0;
    std::size_t bytes_ = 0, most_load_bytes_;
    // As it was told last; null: something has changed since. Cameras, views and exposures move more often.
    mutable std::shared_ptr<const UndoRecord> record_;
};

}  // namespace gonio
