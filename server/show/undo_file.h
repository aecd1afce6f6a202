// PATH.undo beside the file of `--state`: the steps that undo goes on with after a restart. A state and its undo are
// one pair: the undo names the state's bytes by their hash. It is written as PATH.undo-next, then the state, and then
// it gets its name; so one of the two names belongs to the state whenever the program is killed. State thread, and
// start.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/undo_record.h"
#include "server/show/saved_show.h"

namespace gonio {

namespace saved {
class UndoFile;
class UndoSteps;
}  // namespace saved

inline constexpr std::size_t kMaxUndoFileBytes = std::size_t{32} << 20;  // beyond it the oldest goes
inline constexpr const char* kUndoEnding = ".undo";
inline constexpr const char* kUndoNextEnding = ".undo-next";

// Makes the file's bytes, with what it made of earlier scenes the last time.
class UndoFileWriter {
public:
    // Writes the files of an earlier scene beside the state, where they would not be there, and names them in its show.
    // Result: false where that cannot be done: the scene is dropped with those before it.
    using KeepFiles = std::function<bool(const SceneAsset& asset, saved::Show& show)>;
    explicit UndoFileWriter(std::size_t most_bytes = kMaxUndoFileBytes) : most_bytes_(most_bytes) {}
    std::string write(const UndoRecord& record, const Scene& scene, const std::string& state_sha256,
                      const KeepFiles& keep_files);
    // Result: the shows of the earlier scenes that were written last.
    std::vector<std::shared_ptr<const saved::UndoLeft>> lefts() const;

private:
    std::shared_ptr<const saved::UndoLeft> kept_of(const std::shared_ptr<const LeftScene>& left,
                                                   const KeepFiles& keep_files);

    std::size_t most_bytes_;
    ProfileTexts texts_;
    std::map<std::shared_ptr<const LeftScene>, std::shared_ptr<const saved::UndoLeft>> lefts_;
    std::set<std::shared_ptr<const LeftScene>> refused_;  // too large: not tried again
};

// Result: what undo goes on with. Errors, all "bad_state" or "file_unreadable": no such file, a damaged one, one of
// another version or of another state.
Result<saved::UndoFile> read_undo_file(const std::string& path, const std::string& state_sha256);

// Gives the scene's lights the ids that the steps name. Result: false where they are not those lights.
bool renew_ids(const saved::UndoSteps& steps, Scene& scene);
// Result: the steps, for a scene whose lights have these ids. Steps that cannot be read are dropped with those before
// them, and of undone ones with those behind them.
UndoSteps steps_of(const saved::UndoSteps& kept, const Scene& scene, std::uint64_t& last_id);
// The same of a whole file. Scenes before have to be read yet (LeftScene::scene).
UndoRecord record_of(const saved::UndoFile& file, const Scene& scene);

}  // namespace gonio
