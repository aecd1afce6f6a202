#include "server/show/state_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "protocol/schema/undo_file.pb.h"
#include "protocol/schema/upload_name.h"
#include "server/base/bounded_file.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/scene/asset_files.h"
#include "server/scene/scene.h"
#include "server/show/held_files.h"

namespace gonio {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Of this thread on a processor, since it began.
static std::chrono::nanoseconds busy_time() {
    timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

StateFile::StateFile(std::string path, std::chrono::milliseconds interval, std::chrono::milliseconds retry,
                     std::size_t most_bytes, WriteFile to_disk)
    : path_(std::move(path)),
      interval_(interval),
      retry_(retry),
      most_bytes_(most_bytes),
      to_disk_(std::move(to_disk)),
      thread_([this] { work(); }) {}

Result<bool> StateFile::write(const std::string& json) const {
    if (json.empty()) return Error{"file_unwritable", "", path_, "a name in it is not UTF-8"};
    if (json.size() > most_bytes_) {
        return Error{
            "too_large", "", path_,
            "the show has " + std::to_string(json.size()) + " bytes, its file at most " + std::to_string(most_bytes_)};
    }
    return to_disk_(path_, json);
}

StateFile::~StateFile() {
    close();
    thread_.join();
}

void StateFile::close() {
    scenes_.close();
    ended_.wait(false);
}

bool StateFile::close_within(std::chrono::milliseconds time) {
    scenes_.close();
    const auto end = Clock::now() + time;
    while (!ended_.load() && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return ended_.load();
}

void StateFile::put(Scene scene, std::shared_ptr<const UndoRecord> undo) {
    if (kept_ == put_) unsaved_since_ = monotonic_ns();
    const std::uint64_t number = ++put_;
    scenes_.put({std::move(scene), number, std::move(undo)});
}

const StateFile::Told& StateFile::told() {
    if (auto news = news_.try_take()) told_ = std::move(*news);
    told_.unsaved_s = kept_ == put_ ? 0.0 : seconds_since(unsaved_since_);
    return told_;
}

// Whether the scene's own file is where its name says.
static bool is_lasting(const SceneAsset& asset) {
    if (asset.name.starts_with(kUploadPrefix)) return false;
    return std::ranges::none_of(fs::path(asset.files->folder),
                                [](const fs::path& part) { return part.string().starts_with(".part-"); });
}

static std::string scene_file_of(const std::string& path, const saved::Show& show) {
    return path + kSceneEnding + held_key(show).substr(0, 16);
}

// Writes the scene's files beside the show where that needs them, once a scene. Errors: of the disk.
Result<bool> StateFile::keep_scene(const SceneAsset& asset, saved::Show& show) {
    if (!asset.files || asset.files->files.empty()) return true;
    if (scene_files_ == asset.files) {
        if (scene_kept_) hold_files(asset, false, show);
        return true;
    }
    saved::Show held;
    if (!is_lasting(asset)) {
        if (const std::string why = hold_files(asset, true, held); !why.empty())
            spdlog::warn("state: '{}' will not be there after a restart: {}", asset.name, why);
    }
    if (!held.files().empty()) {
        const std::string file = scene_file_of(path_, held);
        const auto written = to_disk_(file, held.SerializeAsString());
        if (!written) return written;
        hand_on_permissions(file);
        hold_files(asset, false, show);
    }
    scene_kept_ = !held.files().empty();
    scene_files_ = asset.files;
    return true;
}

// Whoever may not read the show may not read its scene or its past.
void StateFile::hand_on_permissions(const std::string& file) const {
    std::error_code failed;
    if (fs::exists(path_, failed)) fs::permissions(file, fs::status(path_, failed).permissions(), failed);
}

// The same of a scene that undo goes back to, whose files may lie there from when it was shown.
bool StateFile::keep_left(const SceneAsset& asset, saved::Show& show) const {
    if (!asset.files || asset.files->files.empty() || is_lasting(asset)) return true;
    if (!hold_files(asset, false, show).empty()) return false;
    const std::string file = scene_file_of(path_, show);
    std::error_code failed;
    if (fs::exists(file, failed)) return true;
    saved::Show held;
    if (!hold_files(asset, true, held).empty() || !to_disk_(file, held.SerializeAsString())) return false;
    hand_on_permissions(file);
    return true;
}

// Before the state that it belongs to; it gets its name when that is on the disk.
Result<bool> StateFile::write_undo(const Waiting& waiting, const std::string& json) {
    const std::string bytes =
        undo_.write(*waiting.undo, waiting.scene, sha256(json),
                    [this](const SceneAsset& asset, saved::Show& show) { return keep_left(asset, show); });
    const std::string next = path_ + kUndoNextEnding;
    const auto written = to_disk_(next, bytes);
    if (written) hand_on_permissions(next);
    return written;
}

// Those of scenes that are neither shown nor come back by undo. A show that is kept aside may need them.
void StateFile::drop_scenes(const saved::Show& show) {
    std::set<std::string> keys{held_key(show)}, names;
    for (const auto& left : undo_.lefts()) keys.insert(held_key(left->show()));
    if (std::exchange(dropped_for_, keys) == keys) return;
    const fs::path own(path_);
    const std::string begin = own.filename().string() + kSceneEnding, aside = own.filename().string() + ".aside";
    for (const std::string& key : keys)
        if (!key.empty()) names.insert(begin + key.substr(0, 16));
    std::vector<fs::path> others;
    std::error_code failed;
    const fs::path folder = own.parent_path().empty() ? fs::path(".") : own.parent_path();
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        if (name.starts_with(aside)) return;
        if (name.starts_with(begin) && !names.contains(name)) others.push_back(entry->path());
    }
    for (const fs::path& other : others) fs::remove(other, failed);
}

// Result: whether it is on the disk.
bool StateFile::save(const Waiting& waiting, std::int64_t taken_ns, bool complete) {
    saved::Show show = show_of(waiting.scene, texts_);
    show.set_complete(complete);
    const Result<bool> kept = keep_scene(*waiting.scene.asset, show);
    const std::string json = write_show(show);
    Result<bool> past = waiting.undo && !json.empty() ? write_undo(waiting, json) : true;
    Result<bool> written = write(json);
    std::error_code failed;
    if (!written && waiting.undo && past) {  // there may be room for the show alone
        fs::remove(path_ + kUndoNextEnding, failed);
        past = written.error();
        written = write(json);
    }
    const std::string error = !written ? written.error().text() : !kept ? kept.error().text() : "";
    if (!error.empty() && saving_.error.empty())
        spdlog::warn("state: not saved: {}; it is tried again", error);
    else if (error.empty() && !saving_.error.empty())
        spdlog::info("state: saved again to {}", path_);
    saving_.error = error;
    if (written) {
        ++saving_.saves;
        unsaved_since_ = taken_ns;  // of what came later
        kept_ = waiting.number;
        if (waiting.undo && past) fs::rename(path_ + kUndoNextEnding, path_ + kUndoEnding, failed);
        if (!past && past_kept_) spdlog::warn("state: undo is not kept over a restart: {}", past.error().text());
        if (past && !past_kept_) spdlog::info("state: undo is kept again");
        past_kept_ = static_cast<bool>(past);
        drop_scenes(show);
    }
    news_.put(saving_);
    return kept && written;  // undo is written again with the next change
}

void StateFile::work() {
    std::optional<Waiting> last;  // that was taken
    std::int64_t taken_ns = 0;
    bool saved = false;  // and is on the disk
    bool closed = false;
    while (!closed) {
        // A scene that is not on the disk is not waited for, only a newer one is better.
        auto scene = last && !saved ? scenes_.try_take() : scenes_.take();
        if (scene) {
            last = std::move(scene);
            taken_ns = monotonic_ns();
        }
        closed = scenes_.closed_within(std::chrono::nanoseconds(0));
        if (!last || closed) break;
        const auto began = busy_time();
        saved = save(*last, taken_ns, false);
        const auto rest = std::clamp<std::chrono::nanoseconds>(20 * (busy_time() - began), interval_,
                                                               std::max(interval_, kMostSaveRest));
        closed = scenes_.closed_within(rest);
        // After a failure a change is tried at once, the same scene only after a while.
        for (auto waited = rest; !saved && !closed && !scenes_.waiting() && waited < retry_; waited += interval_)
            closed = scenes_.closed_within(interval_);
    }
    if (auto newest = scenes_.try_take()) last = std::move(newest);
    if (last) save(*last, monotonic_ns(), true);
    ended_ = true;
    ended_.notify_all();
}

void find_scene(const std::string& path, saved::Show& show) {
    if (show.files().empty() || !show.files(0).content().empty()) return;  // a show that was saved has them
    const std::string file = scene_file_of(path, show);
    const auto bytes = read_bounded_file(file, kMostHeldBytes + kMaxHeldNames);
    saved::Show held;
    if (bytes && held.ParseFromString(*bytes) && held_key(held) == held_key(show)) {
        *show.mutable_files() = std::move(*held.mutable_files());
        return;
    }
    spdlog::warn("state: the files of the scene '{}' cannot be read from {}", show.scene(), file);
    show.clear_files();
}

std::optional<saved::Show> read_state_file(const std::string& path, std::string* sha256_of_it) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0 && errno == ENOENT) return std::nullopt;
    Result<saved::Show> show = Error{"file_unreadable", "", path, "It cannot be read."};
    if (const auto text = read_bounded_file(path, kMaxSavedBytes)) {
        show = read_show(*text);
        if (sha256_of_it != nullptr) *sha256_of_it = sha256(*text);
    }
    if (show) {
        find_scene(path, *show);
        return std::move(*show);
    }
    const Error& error = show.error();
    if (error.code == "file_unreadable") throw std::invalid_argument(error.text());
    const auto aside = set_file_aside(path, error.code == "unsupported" ? ".aside" : ".bad");
    if (!aside) throw std::invalid_argument(aside.error().text());
    spdlog::error("state: {} cannot be used: {} It is kept as {}; the show begins anew", path, error.message, *aside);
    return std::nullopt;
}

}  // namespace gonio
