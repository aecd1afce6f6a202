// Shared<T>: a std::shared_ptr that every thread may read and replace. (std::atomic<std::shared_ptr> of libstdc++ 12
// ends a load with relaxed order, so that a store after it races with it.)
#pragma once

#include <memory>
#include <mutex>

namespace gonio {

template <typename T>
class Shared {
public:
    std::shared_ptr<T> load() const {
        std::lock_guard lock(mutex_);
        return value_;
    }
    // What was there before ends after the lock, where nobody else has it.
    void store(std::shared_ptr<T> value) {
        std::lock_guard lock(mutex_);
        value_.swap(value);
    }

private:
    mutable std::mutex mutex_;
    std::shared_ptr<T> value_;
};

}  // namespace gonio
