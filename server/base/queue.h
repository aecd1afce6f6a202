// Queue<T> and Latest<T>: what is moved from one thread to another.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace gonio {

// Bounded FIFO. At the bound, push returns false and the caller says so to whoever sent the value.
template <typename T>
class Queue {
public:
    explicit Queue(std::size_t capacity) : capacity_(capacity) {}

    bool push(T value) {
        {
            std::lock_guard lock(mutex_);
            if (closed_ || values_.size() >= capacity_) return false;
            values_.push_back(std::move(value));
        }
        ready_.notify_one();
        return true;
    }
    std::optional<T> try_pop() {
        std::lock_guard lock(mutex_);
        return take();
    }
    // Waits until a value, close() or wake() comes, or the time is over.
    std::optional<T> pop_for(std::chrono::nanoseconds time) {
        std::unique_lock lock(mutex_);
        ready_.wait_for(lock, time, [&] { return closed_ || woken_ || !values_.empty(); });
        woken_ = pressing_ = false;
        return take();
    }
    // Waits for a value; empty once closed and drained.
    std::optional<T> pop() {
        std::unique_lock lock(mutex_);
        ready_.wait(lock, [&] { return closed_ || !values_.empty(); });
        return take();
    }
    // now: it is pressing, too.
    enum class Wake { now, soon };
    void wake(Wake when = Wake::now) {
        {
            std::lock_guard lock(mutex_);
            woken_ = true;
            if (when == Wake::now) pressing_ = true;
        }
        ready_.notify_one();
    }
    // Whether what came should interrupt the work of the one that pops.
    bool pressing() const {
        std::lock_guard lock(mutex_);
        return closed_ || pressing_ || !values_.empty();
    }
    void close() {
        {
            std::lock_guard lock(mutex_);
            closed_ = true;
        }
        ready_.notify_all();
    }
    bool closed() const {
        std::lock_guard lock(mutex_);
        return closed_;
    }

private:
    std::optional<T> take() {
        if (values_.empty()) return std::nullopt;
        std::optional<T> value(std::move(values_.front()));
        values_.pop_front();
        return value;
    }
    mutable std::mutex mutex_;
    std::condition_variable ready_;
    std::deque<T> values_;
    std::size_t capacity_;
    bool closed_ = false;
    bool woken_ = false, pressing_ = false;
};

// Holds one value: a newer one replaces an older one that nobody took.
template <typename T>
class Latest {
public:
    void put(T value) {
        {
            std::lock_guard lock(mutex_);
            value_ = std::move(value);
        }
        ready_.notify_one();
    }
    // Adds to the value that nobody took yet, or to a fresh one: for values that hold the newest of several things.
    // Result: whether it was a fresh one, so that whoever takes it need be woken only then.
    template <typename Edit>
    bool merge(const Edit& edit) {
        bool fresh = false;
        {
            std::lock_guard lock(mutex_);
            fresh = !value_;
            if (fresh) value_.emplace();
            edit(*value_);
        }
        ready_.notify_one();
        return fresh;
    }
    bool waiting() const {
        std::lock_guard lock(mutex_);
        return value_.has_value();
    }
    std::optional<T> try_take() {
        std::lock_guard lock(mutex_);
        return std::exchange(value_, std::nullopt);
    }
    // Waits for a value; empty once closed.
    std::optional<T> take() {
        std::unique_lock lock(mutex_);
        ready_.wait(lock, [&] { return closed_ || value_.has_value(); });
        return std::exchange(value_, std::nullopt);
    }
    // Waits until it is closed or the time is over. Result: whether it is closed.
    bool closed_within(std::chrono::nanoseconds time) {
        std::unique_lock lock(mutex_);
        return ready_.wait_for(lock, time, [&] { return closed_; });
    }
    void close() {
        {
            std::lock_guard lock(mutex_);
            closed_ = true;
        }
        ready_.notify_all();
    }

private:
    mutable std::mutex mutex_;
    std::condition_variable ready_;
    std::optional<T> value_;
    bool closed_ = false;
};

}  // namespace gonio
