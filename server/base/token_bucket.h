// A rate with a burst. Pure logic: the time is a parameter.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>

namespace gonio {

class TokenBucket {
public:
    using Time = std::chrono::steady_clock::time_point;
    TokenBucket(double per_s, double burst) : per_s_(per_s), burst_(burst), left_(burst) {}

    // Result: zero, and `count` are taken; else when one will be there, at least 1 ms. One is enough to take more: what
    // was taken too much is waited for afterwards.
    std::chrono::milliseconds take(Time now, double count = 1) {
        fill(now);
        if (left_ >= 1) {
            left_ -= count;
            return std::chrono::milliseconds(0);
        }
        return std::chrono::milliseconds(std::max(1L, std::lround(std::ceil((1 - left_) / per_s_ * 1000))));
    }

    // Result: whether all of `count` were there; then they are taken.
    bool take_whole(Time now, double count) {
        fill(now);
        if (left_ < count) return false;
        left_ -= count;
        return true;
    }
    Time asked() const { return filled_; }  // last

private:
    void fill(Time now) {
        if (now <= filled_) return;
        left_ = filled_ == Time()
                    ? burst_
                    : std::min(burst_, left_ + per_s_ * std::chrono::duration<double>(now - filled_).count());
        filled_ = now;
    }
    double per_s_, burst_, left_;
    Time filled_{};
};

}  // namespace gonio
