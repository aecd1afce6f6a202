// How long it takes from the arrival of a command to the frame that shows it. Pure logic: the time is a parameter; of
// more commands than kMost at a time the oldest are not measured.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

namespace gonio {

class UpdateClock {
public:
    using Time = std::chrono::steady_clock::time_point;
    static constexpr std::size_t kMost = 256;
    static constexpr std::chrono::seconds kStale{10};  // nobody took a picture meanwhile: that says nothing

    void arrived(std::uint32_t session, std::uint32_t request_id, Time now) {
        if (request_id == 0) return;  // never answered: its revision is not known
        if (waiting_.size() >= kMost) waiting_.pop_front();
        waiting_.push_back({session, request_id, 0, now});
    }
    // Result: whether it was the answer to a command.
    bool answered(std::uint32_t session, std::uint32_t request_id, bool ok, std::uint32_t scene_rev) {
        for (auto one = waiting_.begin(); one != waiting_.end(); ++one) {
            if (one->session != session || one->request_id != request_id || one->scene_rev != 0) continue;
            if (ok)
                one->scene_rev = scene_rev;
            else
                waiting_.erase(one);
            return true;
        }
        return false;
    }
    // Calls took(duration) for each command that the frame is the first to show.
    template <typename Took>
    void shown(std::uint32_t scene_rev, Time now, const Took& took) {
        std::erase_if(waiting_, [&](const Waiting& one) {
            if (one.scene_rev == 0 || one.scene_rev > scene_rev) return now - one.at > kStale;
            if (now - one.at <= kStale) took(now - one.at);
            return true;
        });
    }

private:
    struct Waiting {
        std::uint32_t session, request_id, scene_rev;  // scene_rev 0: not answered yet
        Time at;
    };
    std::deque<Waiting> waiting_;
};

}  // namespace gonio
