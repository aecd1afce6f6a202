// GET /v1/blobs: what was published, by its hash, and nothing else.
#include <filesystem>
#include <fstream>

#include "server/base/sha256.h"
#include "server/http/blobs.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
namespace fs = std::filesystem;

struct FrontBlobsTest : FrontTest {
    std::string file = (fs::temp_directory_path() / ("gonio-blob-" + std::to_string(::getpid()))).string();
    ~FrontBlobsTest() override {
        front.reset();
        fs::remove(file);
    }
    // Publishes a file of so many bytes and a text. Result: the hash of the file.
    std::string publish(std::size_t bytes) {
        std::string content(bytes, 'x');
        for (std::size_t i = 0; i < bytes; ++i) content[i] = static_cast<char>(i * i >> 8);
        std::ofstream(file, std::ios::binary) << content;
        auto blobs = std::make_shared<Blobs>();
        const std::string hash = sha256(content);
        (*blobs)[hash] = {nullptr, file, bytes};
        (*blobs)[sha256("text")] = {std::make_shared<const std::string>("text"), "", 4};
        front->publish_blobs(blobs);
        return hash;
    }
    int get(const std::string& path, const std::string& headers = "") {
        Client client(front->port());
        client.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
        const int status = client.read_response();
        said = client.body;
        return status;
    }
    std::string said;
};

TEST_F(FrontBlobsTest, AreServedByTheirHash) {
    start();
    const std::string text = "/v1/blobs/" + sha256("text");
    EXPECT_EQ(get(text), 404) << "nothing is published yet";
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{5}, std::size_t{3'000'000}}) {  // several chunks
        const std::string hash = publish(bytes);
        EXPECT_EQ(get("/v1/blobs/" + hash), 200);
        EXPECT_EQ(said.size(), bytes);
        EXPECT_EQ(sha256(said), hash);
    }
    EXPECT_EQ(get(text), 200);
    EXPECT_EQ(said, "text");
    for (const std::string path : {"", "x", "../../etc/passwd", "%2e%2e/%2e%2e/etc/passwd"})
        EXPECT_EQ(get("/v1/blobs/" + path), 404) << path;
    EXPECT_EQ(get("/v1/blobs/" + file), 404) << "no path is a name";
}

TEST_F(FrontBlobsTest, OfAFileThatIsGoneOrShorterIsNoWholeAnswer) {
    start();
    const std::string hash = publish(1000);
    fs::resize_file(file, 10);
    Client client(front->port());
    client.send("GET /v1/blobs/" + hash + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_EQ(client.read_response(), 404) << "it is not what was published";
    EXPECT_EQ(client.body, "") << "and nothing of it is sent";
    fs::remove(file);
    EXPECT_EQ(get("/v1/blobs/" + hash), 404);
}

TEST_F(FrontBlobsTest, NeedTheTokenThatAPictureNeeds) {
    options.tokens = {"0123456789abcdef", "fedcba9876543210"};
    start();
    const std::string path = "/v1/blobs/" + publish(100);
    EXPECT_EQ(get(path), 401);
    EXPECT_EQ(get(path, "Authorization: Bearer fedcba9876543210\r\n"), 200) << "a viewer's is enough";
}

TEST_F(FrontBlobsTest, AFollowerTakesNoUploads) {
    options.leader = "http://leader:8080";
    start();
    Client client(front->port());
    client.send("PUT /v1/uploads/a.glb HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\n\r\nx");
    EXPECT_EQ(client.read_response(), 403);
    EXPECT_NE(client.body.find("http://leader:8080"), std::string::npos);
}

}  // namespace
}  // namespace gonio
