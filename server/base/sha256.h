// SHA-256 (FIPS 180-4): names files, profiles and shows by their content. Any thread.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace gonio {

// Of bytes that come one after the other.
class Sha256 {
public:
    Sha256();
    ~Sha256();
    Sha256(const Sha256&) = delete;
    Sha256& operator=(const Sha256&) = delete;
    void add(const void* bytes, std::size_t count);
    // Result: 64 hexadecimal digits; then nothing more may be added.
    std::string text();

private:
    struct State;
    std::unique_ptr<State> state_;
};

// Result: 64 hexadecimal digits.
std::string sha256(std::string_view bytes);
// Result: whether the text is 64 hexadecimal digits, as the functions here write them.
bool is_sha256(std::string_view text);

// Result: of a regular file's bytes, and how many there are; an empty text where it cannot be read. It takes as long
// as the disk.
struct FileDigest {
    std::string sha256;
    std::size_t bytes = 0;
};
FileDigest sha256_of_file(const std::string& path);

}  // namespace gonio
