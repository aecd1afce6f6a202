// One HTTP request to a goniod on 127.0.0.1, and its answer.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace gonio::soak {

// Result: the answer's status and body; 0 where none came within 20 s.
std::pair<int, std::string> http_answer(std::uint16_t port, const std::string& request);
std::pair<int, std::string> put_upload(std::uint16_t port, const std::string& name, const std::string& content);

}  // namespace gonio::soak
