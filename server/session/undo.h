// What each client can undo and redo. A step holds, by property, the value before and after a command; it sets back
// those whose last writer it still is. Pure. Render thread.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/session.pb.h"
#include "server/scene/edit.h"

namespace gonio {

inline constexpr std::size_t kMaxUndoSteps = 100;        // of a key; beyond it the oldest goes
inline constexpr std::size_t kMaxUndoKeys = 64;          // beyond it the one that was not used for longest goes
inline constexpr std::size_t kMaxUndoBytes = 16u << 20;  // of all keys; beyond it the oldest step of all goes
inline constexpr std::size_t kMaxUndoWarnings = 16;      // of one answer; the rest is counted

// What an undo or redo is about to do.
struct UndoPlan {
    std::vector<EditTarget> targets;    // for apply(), which says itself what it cannot do
    std::vector<std::string> warnings;  // what stays, because another changed it
    std::uint64_t step = 0;
    std::string label;
};

class Undo {
public:
    // undo_key: whose steps the session goes on with; empty: its own. wants: whether it is told of labels.
    void identify(std::uint32_t session, const std::string& undo_key, bool wants);
    void forget_session(std::uint32_t session);

    // A command of a client was applied. Result: the step that it is, 0 where it is none: of a look (camera, view,
    // exposure, size, technique) or without a change. A recall that fades is a step of all that the fade will change.
    std::uint64_t note(std::uint32_t session, const Scene& before, const Scene& after, const v1::Command& command);
    // A console, a fader box, or a fade of the step changed what it changed after the revision.
    void note_inputs(const Scene& after, Revision since, std::uint64_t fading = 0);

    // Result: what to set back, of the session's last step, or of the last that it undid. Errors: "not_found".
    Result<UndoPlan> plan(std::uint32_t session, bool redo, const Scene& scene) const;
    // The plan was applied. Result: what it changed.
    std::vector<Edit> carried_out(std::uint32_t session, bool redo, const UndoPlan& plan, const Scene& before,
                                  const Scene& after);

    // Result: the sessions whose labels are others than they were told, and the labels.
    std::vector<std::pair<std::uint32_t, v1::UndoState>> take_news();
    std::size_t bytes() const { return bytes_; }
    std::size_t keys() const { return stacks_.size(); }

private:
    struct StepEdit {
        EditValue before, after;
        std::uint64_t before_writer = 0;
        bool undone = false;
    };
    struct Step {
        std::uint64_t id = 0;
        std::uint32_t session = 0, gesture = 0;
        std::string label;
        std::map<EditKey, StepEdit> edits;
        std::size_t bytes = 0;
    };
    struct Stack {
        std::deque<Step> steps;
        std::size_t done = 0;  // the steps before it can be undone, the others redone
        bool emptied_by_load = false;
        std::uint64_t used = 0;
    };
    // Who wrote a property last that a step knows.
    struct Writer {
        std::uint64_t step = 0;  // or a number of its own, of a writer that has no step
        bool input = false;      // a console or a fader box
        std::size_t uses = 0;    // steps that know the property
        EditValue now;
    };
    struct Session {
        std::string key;
        bool wants = false;
        v1::UndoState told;
    };
    const Stack* stack_of(std::uint32_t session) const;
    Stack& open_stack(const std::string& key);
    void drop_stack(const std::string& key);
    void drop_step(Stack& stack, std::size_t index);
    void empty_for_load();
    void merge(Step& step, std::vector<Edit> edits, const Scene& after);
    void weigh(Step& step);
    void keep_bounds(Stack& stack);
    void write(const EditKey& key, const Scene& scene, std::uint64_t by, bool input);
    bool last_writer(const Step& step, const EditKey& key, bool redo) const;
    bool can_go(const Step& step, std::uint32_t light, bool redo, const Scene& scene) const;

    std::map<std::uint32_t, Session> sessions_;  // as many as the HTTP server lets in
    std::map<std::string, Stack> stacks_;
    std::map<EditKey, Writer> writers_;
    std::uint64_t last_id_ = 0;
    std::size_t bytes_ = 0;
};

}  // namespace gonio
