// Content hashes: two bakes with the same key have the same values. 128 bits, FNV-1a (Fowler, Noll, Vo) over two
// different starts: against mistakes, not against forgers.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace gonio::bake {

class Key {
public:
    void add(const void* bytes, std::size_t size) {
        const auto* p = static_cast<const unsigned char*>(bytes);
        for (std::size_t i = 0; i < size; ++i) {
            for (std::uint64_t& state : state_) state = (state ^ p[i]) * 0x100000001b3ull;
            state_[1] ^= state_[1] >> 29;
        }
    }
    template <typename T>
    requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void add(T value) { add(&value, sizeof value); }
    void add(std::string_view text) {
        add(text.size());
        add(text.data(), text.size());
    }
    template <typename T>
    void add(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        add(values.size());
        add(values.data(), values.size() * sizeof(T));
    }
    // Result: 32 digits.
    std::string text() const {
        constexpr char kDigits[] = "0123456789abcdef";
        std::string result;
        for (const std::uint64_t state : state_) {
            for (int shift = 60; shift >= 0; shift -= 4) result += kDigits[state >> shift & 15u];
        }
        return result;
    }

private:
    std::array<std::uint64_t, 2> state_{0xcbf29ce484222325ull, 0x6c62272e07bb0142ull};
};

}  // namespace gonio::bake
