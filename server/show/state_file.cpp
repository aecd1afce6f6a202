#include "server/show/state_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <ctime>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "server/base/bounded_file.h"
#include "server/base/clock.h"

namespace gonio {

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

void StateFile::put(Scene scene) {
    if (kept_ == put_) unsaved_since_ = monotonic_ns();
    const std::uint64_t number = ++put_;
    scenes_.put({std::move(scene), number});
}

const StateFile::Told& StateFile::told() {
    if (auto news = news_.try_take()) told_ = std::move(*news);
    told_.unsaved_s = kept_ == put_ ? 0.0 : seconds_since(unsaved_since_);
    return told_;
}

// Result: whether it is on the disk.
bool StateFile::save(const Waiting& waiting, std::int64_t taken_ns, bool complete) {
    saved::Show show = show_of(waiting.scene, texts_);
    show.set_complete(complete);
    const Result<bool> written = write(write_show(show));
    const std::string error = written ? "" : written.error().text();
    if (!error.empty() && saving_.error.empty())
        spdlog::warn("state: not saved: {}; it is tried again", error);
    else if (error.empty() && !saving_.error.empty())
        spdlog::info("state: saved again to {}", path_);
    saving_.error = error;
    if (written) {
        ++saving_.saves;
        unsaved_since_ = taken_ns;  // of what came later
        kept_ = waiting.number;
    }
    news_.put(saving_);
    return static_cast<bool>(written);
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

std::optional<saved::Show> read_state_file(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0 && errno == ENOENT) return std::nullopt;
    Result<saved::Show> show = Error{"file_unreadable", "", path, "It cannot be read."};
    if (const auto text = read_bounded_file(path, kMaxSavedBytes)) show = read_show(*text);
    if (show) return std::move(*show);
    const Error& error = show.error();
    if (error.code == "file_unreadable") throw std::invalid_argument(error.text());
    const auto aside = set_file_aside(path, error.code == "unsupported" ? ".aside" : ".bad");
    if (!aside) throw std::invalid_argument(aside.error().text());
    spdlog::error("state: {} cannot be used: {} It is kept as {}; the show begins anew", path, error.message, *aside);
    return std::nullopt;
}

}  // namespace gonio
