// Follows another goniod, on a thread of its own: asks it for what changed, fetches what that needs, and gives the
// render thread the scene as it is there. While the leader is away the last scene stays.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "client/connection/connection.h"
#include "server/assets/assets.h"
#include "server/base/descriptor.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/follow/blob_cache.h"
#include "server/session/work.h"
#include "server/show/followed_show.h"

namespace gonio {

struct FollowOptions {
    std::string url;  // as it was given
    ServerAddress leader;
    std::function<Result<std::string>()> token;   // read anew for each connection
    std::string boot;                             // of this server, before it follows: it does not follow itself
    std::string folder;                           // of what is fetched
    std::uint64_t file_bytes = 0, all_bytes = 0;  // of it
    LoadOptions load;
    std::size_t max_memory = 0;  // as of SceneAccess
};

class Follower {
public:
    // scene: as the render thread has it before anything came. queue and metrics outlive this.
    Follower(FollowOptions options, Scene scene, Queue<Work>& queue, Metrics& metrics);
    ~Follower();
    Follower(const Follower&) = delete;
    Follower& operator=(const Follower&) = delete;

private:
    void work();
    // Result: why it ended.
    Error follow();
    Result<bool> take(const v1::Followed& followed);
    Result<bool> take_gels(Connection& connection);
    Result<bool> load_scene(const FollowedShow& show, FetchedParts& fetched);
    Result<bool> load_profiles(const FollowedShow& show, FetchedParts& fetched);
    void tell(LeaderNews news) const;
    void lost(const Error& why);
    // Waits until the descriptor (-1: none) can be read, at most for so long. Result: false at the end.
    bool wait(int descriptor, std::chrono::milliseconds time, bool* can_be_read = nullptr) const;

    const FollowOptions options_;
    std::string token_;  // of this connection
    Scene scene_;        // that the render thread was given last
    std::string boot_;   // of whom it is; empty: the whole is needed
    bool in_touch_ = false;
    std::string said_;       // of the last loss, in the log
    std::string told_gels_;  // the message that scene_.gels are made of
    std::map<std::string, std::weak_ptr<const Profile>> profiles_;
    Queue<Work>& queue_;
    BlobCache cache_;
    Gauge& connected_;
    Counter &losses_, &taken_;
    Descriptor wake_;
    std::atomic<bool> ended_{false};
    std::thread thread_;
};

// Result: the scene that a server shows that has heard nothing of its leader yet.
Scene unheard_scene(const std::string& url);

}  // namespace gonio
