// Result<T>: a value or one Error. Everything that comes from outside (file, packet, command) is decoded into one.
// It does not throw and does not log; the caller decides who hears of the error.
#pragma once

#include <cstdio>
#include <string>
#include <utility>
#include <variant>

namespace gonio {

// One refusal. Codes are stable, documented in protocol/schema/PROTOCOL.md and tested one by one.
struct Error {
    std::string code;     // snake_case, e.g. "not_a_number"
    std::string where;    // place: "line 12 column 7", "byte 4096", "lights[2].aim", "/materials/0/name"
    std::string value;    // the offending value as it was read; may be empty
    std::string message;  // one sentence in plain words, without place and value

    // "message (where: value)" for people.
    std::string text() const {
        std::string result = message;
        if (where.empty() && value.empty()) return result;
        result += " (" + where;
        if (!value.empty()) result += (where.empty() ? "" : ": ") + value;
        return result + ")";
    }
};

// Result: a number as errors show it, at most 12 characters or so: "0.25", "4294967295", "1e+300", "nan".
inline std::string print_number(double value) {
    constexpr double kAllDigits = 1e10;  // below it a whole number shows all of them
    const bool whole =
        value > -kAllDigits && value < kAllDigits && value == static_cast<double>(static_cast<long long>(value));
    char text[32];
    std::snprintf(text, sizeof text, whole ? "%.0f" : "%.6g", value);
    return text;
}

template <typename T>
class Result {
public:
    Result(T value) : state_(std::move(value)) {}
    Result(Error error) : state_(std::move(error)) {}

    explicit operator bool() const { return state_.index() == 0; }
    bool ok() const { return state_.index() == 0; }
    T& value() { return std::get<0>(state_); }
    const T& value() const { return std::get<0>(state_); }
    T& operator*() { return value(); }
    const T& operator*() const { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    const Error& error() const { return std::get<1>(state_); }

private:
    std::variant<T, Error> state_;
};

}  // namespace gonio
