// Words of a command line for tests.
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace gonio {

// Result: the words between blanks.
inline std::vector<std::string> split(const std::string& line) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    return words;
}

}  // namespace gonio
