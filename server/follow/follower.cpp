#include "server/follow/follower.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/base/memory_room.h"
#include "server/exchange/import_mvr.h"
#include "server/lighting/clusters.h"
#include "server/scene/apply.h"
#include "server/scene/imported.h"
#include "server/scene/light_tables.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kFirstPause = 100ms;
constexpr auto kLongestPause = 1000ms;  // where the leader is away
constexpr auto kLongestRefusal = 10s;   // where it is there, and what it says cannot be followed
constexpr auto kWrongTokenPause = 15s;  // it lets an address guess --max-auth-failures times a minute, usually 5
constexpr auto kAskAgain = 10s;         // what a leader without news says to the question before shows that it lives
constexpr auto kLongestSilence = 30s;
constexpr auto kFrame = 16ms;                                        // from one question to the next at least
constexpr std::size_t kMostWarnings = 16;                            // in the log, of one state
constexpr std::uint64_t kMaxContentBytes = std::uint64_t{16} << 20;  // of a profile with its name and wheel

bool same_files(const SceneAsset& asset, const FollowedShow& show) {
    const double scale = show.show.scene_scale() == 0.0 ? 1.0 : show.show.scene_scale();
    if (asset.name != show.show.scene() || asset.scale != scale) return false;
    if (show.show.has_scene_universe_offset() &&
        (!asset.imported || asset.imported->universe_offset != show.show.scene_universe_offset()))
        return false;
    const std::vector<AssetFile> none;
    return std::ranges::equal(
        asset.files ? asset.files->files : none, show.files,
        [](const AssetFile& a, const AssetFile& b) { return a.path == b.path && a.sha256 == b.sha256; });
}

bool is_wrong_token(const Error& why) {
    return why.where == "close 4003" || why.where == "close 4008" || why.where == "HTTP 401" || why.where == "HTTP 429";
}

Gels gels_of(const v1::Gels& told) {
    Gels gels;
    for (const v1::Gel& one : told.gels()) {
        auto gel = std::make_shared<Gel>();
        gel->name = one.name();
        gel->source = one.source();
        for (const v1::GelMeasurement& measured : one.measured()) {
            if (measured.of_xy_size() != 2 || measured.xy_size() != 2) continue;
            gel->measured.push_back({{measured.of_xy(0), measured.of_xy(1)},
                                     {measured.xy(0), measured.xy(1)},
                                     measured.transmission_ratio()});
        }
        if (!gel->measured.empty() && gels.size() < 2 * kMaxGels) gels.push_back(std::move(gel));
    }
    return gels;
}

}  // namespace

Scene unheard_scene(const std::string& url) {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = url;
    asset->materials.emplace_back();
    asset->bounds = {glm::dvec3(-1.0), glm::dvec3(1.0)};
    Scene scene = scene_of(std::move(asset));
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    scene.drawn = lighting::make_drawn(scene.traced, true);
    return scene;
}

Follower::Follower(FollowOptions options, Scene scene, Queue<Work>& queue, Metrics& metrics)
    : options_(std::move(options)),
      scene_(std::move(scene)),
      queue_(queue),
      cache_(options_.folder, options_.file_bytes, options_.all_bytes,
             [this](const std::string& sha256, std::uint64_t most_bytes, const BlobCache::Take& take) {
                 return fetch(options_.leader, token_, "/v1/blobs/" + sha256, most_bytes,
                              [&](std::string_view bytes) { return !ended_ && take(bytes); });
             }),
      connected_(metrics.gauge("leader_connected", "1 while this server has the state of the one that it follows.")),
      losses_(metrics.counter("leader_losses_total", "Times that the connection to the leader was lost.")),
      taken_(metrics.counter("leader_states_total", "States that were taken from the leader.")),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      thread_([this] { work(); }) {}

Follower::~Follower() {
    ended_ = true;
    ::eventfd_write(wake_.fd(), 1);
    thread_.join();
}

bool Follower::wait(int descriptor, std::chrono::milliseconds time, bool* can_be_read) const {
    std::array<pollfd, 2> waited{pollfd{wake_.fd(), POLLIN, 0}, pollfd{descriptor, POLLIN, 0}};
    ::poll(waited.data(), waited.size(), static_cast<int>(time.count()));
    if (can_be_read != nullptr) *can_be_read = waited[1].revents != 0;
    return !ended_ && !queue_.closed();
}

void Follower::tell(LeaderNews news) const {
    Work work;
    work.leader = std::make_shared<const LeaderNews>(std::move(news));
    while (!ended_ && !queue_.closed() && !queue_.push(work)) wait(-1, 5ms);
}

void Follower::lost(const Error& why) {
    connected_.set(0);
    if (in_touch_) losses_.add();
    if (std::exchange(in_touch_, false) || said_.empty()) tell({});
    const std::string text = why.text();
    if (text != std::exchange(said_, text))
        spdlog::warn("follow: {}: {}: {}; what came last stays", options_.url, why.code, text);
}

void Follower::work() {
    setpriority(PRIO_PROCESS, 0, 5);  // Linux: of this thread and those that it starts, as the loader's
    for (std::chrono::milliseconds pause = kFirstPause;;) {
        Error why{"unavailable", "", "", ""};
        try {
            why = follow();
        } catch (const std::exception& exception) {
            why = {"too_large", "follow", "", std::string("the show cannot be held: ") + exception.what()};
        }
        if (ended_) return;
        if (in_touch_) pause = kFirstPause;
        lost(why);
        const bool away = why.code == "unreachable" || why.code == "unavailable";
        if (!wait(-1, is_wrong_token(why) ? kWrongTokenPause : pause)) return;
        pause = std::min<std::chrono::milliseconds>(2 * pause, away ? kLongestPause : kLongestRefusal);
    }
}

Error Follower::follow() {
    const auto token = options_.token();
    if (!token) return token.error();
    token_ = *token;
    auto opened = Connection::open(options_.leader, {token_, false, false, "viewer", "goniod --follow"});
    if (!opened) return opened.error();
    Connection& connection = **opened;
    end_when_silent(connection.descriptor());
    const v1::State& there = connection.ready().state();
    if (there.boot() == options_.boot)
        return {"invalid_argument", "--follow", options_.url, "this is the address of this server itself"};
    if (const auto gels = take_gels(connection); !gels) return gels.error();
    const Error end{"unavailable", "", "", "The end."};
    std::uint32_t question = 0;
    const auto ask = [&] {
        v1::ClientMessage message;
        message.set_request_id(++question);
        message.mutable_follow()->set_boot(boot_);
        message.mutable_follow()->set_since_rev(boot_.empty() ? 0 : scene_.scene_rev);
        return connection.say(message);
    };
    for (;;) {
        auto asked = Clock::now(), heard = asked;
        if (const auto said = ask(); !said) return said.error();
        for (bool answered = false; !answered;) {
            const auto event = connection.next_arrived();
            if (!event) return event.error();
            const auto now = Clock::now();
            if (!*event) {
                if (now - heard > kLongestSilence)
                    return {"unavailable", "", options_.url, "The leader has stopped answering."};
                if (now - asked > kAskAgain) {
                    asked = now;
                    if (const auto said = ask(); !said) return said.error();
                }
                bool some = false;  // of a message that is still coming
                if (!wait(connection.descriptor(), 1000ms, &some)) return end;
                if (some) heard = Clock::now();
                continue;
            }
            heard = now;
            const v1::ServerMessage& came = (*event)->message;
            if (came.has_goodbye()) return {"unavailable", "", options_.url, "The leader says goodbye."};
            const bool late = came.request_id() != question;  // it crossed that question
            if (came.has_result() && !late)
                return {came.result().code(), came.result().field(), came.result().value(), came.result().message()};
            if (!came.has_followed()) continue;
            if (late && came.followed().scene_rev() != scene_.scene_rev) continue;  // the next answer has it too
            if (const auto taken = take(came.followed()); !taken) {
                boot_.clear();
                return taken.error();
            }
            connected_.set(1);
            if (!std::exchange(in_touch_, true)) {
                said_.clear();
                spdlog::info("follow: {}: in touch at revision {}", options_.url, scene_.scene_rev);
            }
            answered = !late;
        }
        const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(asked + kFrame - Clock::now());
        if (rest > 0ms && !wait(-1, rest)) return end;
    }
}

Result<bool> Follower::take_gels(Connection& connection) {
    v1::ClientMessage question;
    question.mutable_gels();
    const auto answer = connection.ask(std::move(question), [](const v1::Progress&) {});
    if (!answer) return answer.error();
    const std::string told = answer->gels().SerializeAsString();
    if (std::exchange(told_gels_, told) != told) scene_.gels = std::make_shared<const Gels>(gels_of(answer->gels()));
    return true;
}

Result<bool> Follower::load_scene(const FollowedShow& show, FetchedParts& fetched) {
    if (same_files(*scene_.asset, show)) {
        fetched = {scene_.asset, scene_.traced, scene_.drawn, {}};
        return true;
    }
    LoadOptions load = options_.load;
    load.scale = show.show.scene_scale() == 0.0 ? 1.0 : show.show.scene_scale();
    load.universe_offset = show.show.scene_universe_offset();
    std::string path = show.show.scene();
    if (!show.files.empty()) {
        const auto folder = cache_.folder_of(show.files);
        if (!folder) return folder.error();
        path = *folder + "/" + show.files.front().path;
    }
    const auto asset = exchange::load_any_scene(path, show.show.scene(), load, memory_room(options_.max_memory));
    if (!asset) return asset.error();
    if (!same_files(**asset, show))
        return Error{"unsupported", "follow", show.show.scene(),
                     "its files read otherwise here than there: both servers must be of one version"};
    fetched.asset = *asset;
    fetched.traced = std::make_shared<const trace::Geometry>(*asset);
    fetched.drawn = lighting::make_drawn(fetched.traced, true);
    return true;
}

Result<bool> Follower::load_profiles(const FollowedShow& show, FetchedParts& fetched) {
    std::erase_if(profiles_, [](const auto& known) { return known.second.expired(); });
    for (const saved::Profile& profile : show.show.profiles()) {
        std::shared_ptr<const Profile>& own = fetched.profiles[profile.key()];
        if (const auto known = profiles_.find(profile.key()); known != profiles_.end()) own = known->second.lock();
        if (own) continue;
        const auto content = cache_.content(profile.key(), kMaxContentBytes);
        if (!content) return content.error();
        const auto read = followed_profile(*content, profile.uploaded());
        if (!read) return read.error();
        own = *read;
        profiles_[profile.key()] = own;
    }
    for (const saved::Light& light : show.show.lights())
        if (const auto own = fetched.profiles.find(light.profile()); own != fetched.profiles.end())
            tables_of(*own->second);
    return true;
}

Result<bool> Follower::take(const v1::Followed& followed) {
    const auto show = read_followed(followed);
    if (!show) return show.error();
    if (show->since != 0 && (show->boot != boot_ || show->since != scene_.scene_rev))
        return Error{"bad_message", "followed.since_rev", std::to_string(show->since),
                     "it is not what this server has: " + std::to_string(scene_.scene_rev)};
    const bool anew = show->boot != boot_ && show->rev <= scene_.scene_rev;
    if (show->rev < scene_.scene_rev && !anew)
        return Error{"bad_message", "followed.scene_rev", std::to_string(show->rev), "revisions do not go back"};
    FetchedParts fetched;
    if (show->parts.has(ShowPart::scene))
        if (const auto loaded = load_scene(*show, fetched); !loaded) return loaded.error();
    if (const auto loaded = load_profiles(*show, fetched); !loaded) return loaded.error();
    RestoredShow restored = follow_show(scene_, *show, fetched, anew);
    for (std::size_t i = 0; i < std::min(kMostWarnings, restored.warnings.size()); ++i)
        spdlog::warn("follow: {}", restored.warnings[i]);
    if (!restored.warnings.empty() && show->since != 0)
        return Error{"unavailable", "follow", "",
                     "a part of the show could not be brought about; all of it is asked for"};
    scene_ = std::move(restored.scene);
    boot_ = show->boot;
    taken_.add();
    tell({std::make_shared<const Scene>(scene_), boot_, anew, followed.cue_playback()});
    return true;
}

}  // namespace gonio
