// Work that waits until the scene has reached a revision. Pure: the time is a parameter. At the bound nothing is taken.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace gonio {

template <typename Work>
class LateWork {
public:
    LateWork(std::size_t most, std::chrono::nanoseconds patience) : most_(most), patience_ns_(patience.count()) {}

    // Result: false where too much waits already.
    bool add(Work work, std::uint32_t rev, std::int64_t now_ns) {
        if (waiting_.size() >= most_) return false;
        waiting_.push_back({std::move(work), rev, now_ns + patience_ns_});
        return true;
    }
    // Result: one whose revision is there, oldest first; nothing where there is none.
    std::optional<Work> take_due(std::uint32_t rev) {
        return take([&](const Waiting& one) { return one.rev <= rev; });
    }
    // Result: one that waited too long.
    std::optional<Work> take_overdue(std::int64_t now_ns) {
        return take([&](const Waiting& one) { return one.until_ns <= now_ns; });
    }
    // Result: how many.
    template <typename Condition>
    std::size_t forget(const Condition& condition) {
        return std::erase_if(waiting_, [&](const Waiting& one) { return condition(one.work); });
    }
    bool empty() const { return waiting_.empty(); }

private:
    struct Waiting {
        Work work;
        std::uint32_t rev;
        std::int64_t until_ns;
    };
    template <typename Condition>
    std::optional<Work> take(const Condition& condition) {
        const auto one = std::ranges::find_if(waiting_, condition);
        if (one == waiting_.end()) return std::nullopt;
        std::optional<Work> work(std::move(one->work));
        waiting_.erase(one);
        return work;
    }

    std::size_t most_;
    std::int64_t patience_ns_;
    std::vector<Waiting> waiting_;
};

}  // namespace gonio
