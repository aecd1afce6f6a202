// The show on disk: written by a thread of its own when it changed, read at the start.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "server/base/atomic_file.h"
#include "server/base/queue.h"
#include "server/show/saved_show.h"
#include "server/show/undo_file.h"

namespace gonio {

// Between two writes; where one takes long on the processor, twenty times as long, so that writing takes a twentieth of
// a core, but ten seconds at most. A slow disk makes no pause longer: a change is on it after this pause and at most
// two writes.
inline constexpr std::chrono::milliseconds kSaveInterval{1000}, kMostSaveRest{10'000};
inline constexpr std::chrono::milliseconds kSaveRetry{5000};  // after a failure, unless a change comes first

// An upload, or the scene of a show that held it, is not on the disk under its name. Its files lie beside PATH in
// PATH.scene-KEY (held_key). They are written once, when the scene comes, and removed when another one is saved.
inline constexpr const char* kSceneEnding = ".scene-";

// Keeps PATH up to date. A write may fail: a full disk, a folder without rights, a show that is too large to be read
// again. The failure is said in the log once, and the write is tried again. The old file stays and the show goes on.
class StateFile {
public:
    using WriteFile = std::function<Result<bool>(const std::string& path, std::string_view bytes)>;
    struct Told {
        std::uint32_t saves = 0;
        std::string error;   // of the last try; empty: it went well
        double unsaved_s{};  // how long the oldest change has not been on the disk; 0: all are
    };
    // most_bytes: of the file; a show that is larger is not written, since no start would read it. to_disk: writes the
    // file (server/base/atomic_file.h).
    explicit StateFile(std::string path, std::chrono::milliseconds interval = kSaveInterval,
                       std::chrono::milliseconds retry = kSaveRetry, std::size_t most_bytes = kMaxSavedBytes,
                       WriteFile to_disk = write_file_atomically);
    ~StateFile();
    StateFile(const StateFile&) = delete;
    StateFile& operator=(const StateFile&) = delete;

    // The scene has changed. undo: what can be undone in it; null: nothing of that is kept. Render thread; does not
    // wait for the disk.
    void put(Scene scene, std::shared_ptr<const UndoRecord> undo = nullptr);
    // How it goes. Render thread.
    const Told& told();
    // Writes what is not on disk yet, now, and marks the show as complete; then nothing is written any more. Any
    // thread, also several times; returns when it is done.
    void close();
    // The same, at most for so long. Result: whether it is done.
    bool close_within(std::chrono::milliseconds time);

private:
    struct Waiting {
        Scene scene;
        std::uint64_t number;
        std::shared_ptr<const UndoRecord> undo;
    };
    void work();
    bool save(const Waiting& waiting, std::int64_t taken_ns, bool complete);
    Result<bool> keep_scene(const SceneAsset& asset, saved::Show& show);
    bool keep_left(const SceneAsset& asset, saved::Show& show) const;
    void hand_on_permissions(const std::string& file) const;
    Result<bool> write_undo(const Waiting& waiting, const std::string& json);
    void drop_scenes(const saved::Show& show);
    Result<bool> write(const std::string& json) const;

    std::string path_;
    std::chrono::milliseconds interval_, retry_;
    std::size_t most_bytes_;
    WriteFile to_disk_;
    Latest<Waiting> scenes_;
    Latest<Told> news_;
    Told told_;    // the render thread's
    Told saving_;  // the writer's
    // Scenes that came, and of those the last that is on the disk; when the first came that is not, ns (clock.h).
    std::atomic<std::uint64_t> put_{0}, kept_{0};
    std::atomic<std::int64_t> unsaved_since_{0};
    ProfileTexts texts_;
    // Of the scene that the disk has beside the show, or needs not; null: of none yet.
    std::shared_ptr<const AssetFiles> scene_files_;
    bool scene_kept_ = false;                        // its files lie beside the show
    std::set<std::string> dropped_for_{"at first"};  // held_key() of the shows when those of others were removed
    UndoFileWriter undo_;
    bool past_kept_ = true;  // what can be undone is on the disk too
    std::atomic<bool> ended_{false};
    std::thread thread_;
};

// What is in a state file. Result: nothing where there is no file yet. A file that cannot be used is renamed to
// PATH.bad, one of a later version to PATH.aside; both are said in the log. Throws std::invalid_argument where a file
// is there that can neither be read nor renamed: it would be lost.
// sha256_of_it: gets the hash of its bytes.
std::optional<saved::Show> read_state_file(const std::string& path, std::string* sha256_of_it = nullptr);

// Puts the scene's files into the show that names them, from beside the state file. Where they are not there the scene
// is sought by its name.
void find_scene(const std::string& path, saved::Show& show);

}  // namespace gonio
