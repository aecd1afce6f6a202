// Who showed wrong tokens too often. Pure logic: the time is a parameter. Addresses are compared as text; an IPv6
// client owns a whole /64, so the caller passes that.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <string>

namespace gonio {

class AuthGuard {
public:
    using Time = std::chrono::steady_clock::time_point;
    static constexpr std::chrono::seconds kWindow{60};
    static constexpr std::size_t kMaxAddresses = 4096;  // then the oldest window is forgotten for a new one

    explicit AuthGuard(unsigned most) : most_(most) {}

    // A wrong token came. The first one of an address begins its minute.
    void failed(const std::string& address, Time now) {
        if (windows_.size() >= kMaxAddresses && !windows_.contains(address)) forget_oldest();
        Window& window = windows_.try_emplace(address, Window{now, 0}).first->second;
        if (now - window.began >= kWindow) window = {now, 0};
        ++window.failures;
    }
    // Result: how long nothing that needs a token is answered; zero: it is.
    std::chrono::seconds blocked(const std::string& address, Time now) const {
        const auto found = windows_.find(address);
        if (found == windows_.end() || found->second.failures < most_) return std::chrono::seconds(0);
        const auto left = kWindow - (now - found->second.began);
        if (left <= Time::duration::zero()) return std::chrono::seconds(0);
        return std::chrono::ceil<std::chrono::seconds>(left);
    }
    std::size_t addresses() const { return windows_.size(); }

private:
    struct Window {
        Time began;
        unsigned failures;
    };
    void forget_oldest() {
        windows_.erase(std::ranges::min_element(windows_, {}, [](const auto& one) { return one.second.began; }));
    }

    unsigned most_;
    std::map<std::string, Window> windows_;
};

}  // namespace gonio
