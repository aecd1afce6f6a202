// A self-signed certificate for localhost, made by openssl(1) when a test needs one.
#pragma once

#include <cstdlib>
#include <string>

namespace gonio::test {

// Writes FOLDER/NAME.crt and FOLDER/NAME.key. Result: whether openssl could.
inline bool make_certificate(const std::string& folder, const std::string& name) {
    const std::string path = folder + "/" + name;
    return std::system(("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=" +
                        name + " -addext subjectAltName=DNS:localhost,IP:127.0.0.1 -keyout " + path + ".key -out " +
                        path + ".crt 2>/dev/null")
                           .c_str()) == 0;
}

}  // namespace gonio::test
