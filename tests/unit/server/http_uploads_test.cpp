#include <filesystem>
#include <fstream>
#include <thread>

#include "client/connection/connection.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/upload_name.h"
#include "server/http/upload_store.h"
#include "server/session/scene_access.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
namespace fs = std::filesystem;

struct FrontUploadsTest : FrontTest {
    std::unique_ptr<UploadStore> store;
    ~FrontUploadsTest() override { front.reset(); }

    void start_with_uploads() {
        auto opened = UploadStore::open("", options.limits);
        ASSERT_TRUE(opened) << opened.error().text();
        store = std::move(*opened);
        options.uploads = store.get();
        start();
    }
    int put(const std::string& name, const std::string& body, const std::string& headers = "") {
        Client client(front->port());
        client.send("PUT /v1/uploads/" + name + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                    std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
        const int status = client.read_response();
        said = client.body;
        return status;
    }
    std::string content(const std::string& name) const {
        std::ifstream file(store->folder() + "/" + name, std::ios::binary);
        return std::string((std::istreambuf_iterator<char>(file)), {});
    }
    std::size_t files() const {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(store->folder()), fs::directory_iterator()));
    }
    // What is refused is answered first and removed then.
    bool files_become(std::size_t count) const {
        for (int i = 0; i < 600 && files() != count; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        return files() == count;
    }
    std::string said;
};

TEST(UploadName, IsNoPath) {
    for (const char* good : {"a.glb", "Room_1-b.GLTF", "x.y.ies", "L.ldt", "t.xml", "t.IESXML", "p.gldf", "m.zip",
                             "a b.glb", "Büro 2. Stock.glb", "会議室.mvr", "it's 50%.glb", "upload:a.glb"})
        EXPECT_TRUE(is_upload_name(good)) << good;
    for (const char* bad : {"", ".glb", "..glb", "a", "a.exe", "a.glb/", "../a.glb", "a/b.glb", "a\\b.glb", "a\"b.glb",
                            " a.glb", "a.glb ", "a\tb.glb", "\xFF.glb",
                            "\xE2\x80\xAE"
                            "bg.glb",
                            "a.glb\n", "a.glb.part"})
        EXPECT_FALSE(is_upload_name(bad)) << bad;
    EXPECT_TRUE(is_upload_name(std::string(116, 'a') + ".glb"));
    EXPECT_FALSE(is_upload_name(std::string(117, 'a') + ".glb"));
}

TEST_F(FrontUploadsTest, ATokenThatIsWithdrawnMeanwhileFinishesNothing) {
    options.tokens.all = "0123456789abcdef";
    start_with_uploads();
    const std::string token = "Authorization: Bearer 0123456789abcdef\r\n";
    Client upload(front->port()), still(front->port());
    upload.send("PUT /v1/uploads/a.glb HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\n" + token + "\r\nab");
    still.send("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n" + token + "\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    ASSERT_TRUE(files_become(1));
    front->set_tokens({"fedcba9876543210", ""});
    upload.send("cd");
    EXPECT_EQ(upload.read_response(), 403);
    EXPECT_TRUE(files_become(0));
    v1::ServerMessage picture;
    picture.mutable_capture()->set_format("png");
    picture.mutable_capture()->set_image("PNGBYTES");
    front->reply(requests[0].first, picture);
    EXPECT_EQ(still.read_response(), 401);
}

TEST_F(FrontUploadsTest, FilesArriveWholeAndAreReplacedAndRemoved) {
    start_with_uploads();
    const std::string body(300'000, 'x');
    EXPECT_EQ(put("room.glb", body), 201) << said;
    EXPECT_EQ(said, "{\"name\":\"room.glb\",\"bytes\":300000}\n");
    EXPECT_EQ(content("room.glb"), body);
    EXPECT_EQ(put("room.glb", "small"), 200);
    EXPECT_EQ(content("room.glb"), "small");
    EXPECT_EQ(put("empty.ies", ""), 201);
    EXPECT_EQ(files(), 2u);
    const auto status = fs::status(store->folder() + "/room.glb");
    EXPECT_EQ(status.permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/room.glb", "", "", "DELETE"), 200);
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/room.glb", "", "", "DELETE"), 404);
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/empty.ies"), 405) << "they are not served";
    EXPECT_EQ(files(), 1u);
}

TEST_F(FrontUploadsTest, ChunksAndExpectedBodiesAreRead) {
    start_with_uploads();
    Client chunked(front->port());
    chunked.send(
        "PUT /v1/uploads/a.ies HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
        "3\r\nabc\r\n4\r\ndefg\r\n0\r\n\r\n");
    EXPECT_EQ(chunked.read_response(), 201);
    EXPECT_EQ(content("a.ies"), "abcdefg");
    Client expecting(front->port());
    expecting.send(
        "PUT /v1/uploads/b.ies HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n");
    EXPECT_EQ(expecting.read_response(), 100);
    expecting.send("hi");
    EXPECT_EQ(expecting.read_response(), 201);
    EXPECT_EQ(content("b.ies"), "hi");
}

TEST_F(FrontUploadsTest, ChunksThatAreNoneAre400) {
    start_with_uploads();
    for (const char* body : {"zz\r\nabcde\r\n0\r\n\r\n", "3\r\nabcXX\r\n0\r\n\r\n", "3\r\nabc\r\nzz\r\n"}) {
        Client client(front->port());
        client.send("PUT /v1/uploads/a.ies HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" +
                    std::string(body));
        EXPECT_EQ(client.read_response(), 400) << body;
        EXPECT_EQ(client.body.find("bad_message: "), 0u) << client.body;
        EXPECT_NE(client.body.find("a.ies"), std::string::npos) << client.body;
        EXPECT_TRUE(client.receive_end());
    }
    EXPECT_TRUE(files_become(0));
}

TEST_F(FrontUploadsTest, NamesThatAreNoNamesAreRefused) {
    start_with_uploads();
    for (const char* bad : {"..%2Fx.glb", "%2Fetc%2Fx.glb", "x.txt", ".part-1.glb", "a%0Ab.glb", "%20a.glb", ""})
        EXPECT_EQ(put(bad, "x"), 400) << bad;
    EXPECT_EQ(put("x.glb%00", "x"), 400);
    EXPECT_EQ(files(), 0u);
    EXPECT_FALSE(fs::exists(fs::path(store->folder()).parent_path() / "x.glb"));
}

TEST_F(FrontUploadsTest, WhatIsTooMuchIsRefusedAndLeavesNothing) {
    options.limits.upload_bytes = 100'000;
    options.limits.upload_total_bytes = 150'000;
    options.limits.upload_files = 2;
    start_with_uploads();
    EXPECT_EQ(put("big.glb", std::string(100'001, 'x')), 413);
    Client endless(front->port());  // says nothing of its length
    endless.send("PUT /v1/uploads/a.glb HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n");
    for (int i = 0; i < 3; ++i) endless.send("a000\r\n" + std::string(0xa000, 'x') + "\r\n");
    EXPECT_EQ(endless.read_response(), 413);
    EXPECT_TRUE(files_become(0));
    EXPECT_EQ(put("one.glb", std::string(90'000, 'x')), 201);
    EXPECT_EQ(put("two.glb", std::string(90'000, 'x')), 507);
    EXPECT_EQ(put("two.glb", "x"), 201);
    EXPECT_EQ(put("three.glb", "x"), 507);
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/two.glb", "", "", "DELETE"), 200);
    EXPECT_EQ(put("three.glb", "x"), 201);
    EXPECT_TRUE(files_become(2));
}

TEST_F(FrontUploadsTest, AClientThatLeavesLeavesNothing) {
    options.limits.write_stall = std::chrono::milliseconds(200);
    start_with_uploads();
    const std::string begin = "PUT /v1/uploads/a.glb HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nsome";
    { Client(front->port()).send(begin); }
    Client stalls(front->port());
    stalls.send(begin);
    EXPECT_TRUE(stalls.receive_end(2000));
    for (int i = 0; i < 100 && files() > 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(files_become(0));
}

TEST(UploadFolder, IsOneStoresAlone) {
    std::string pattern = (fs::temp_directory_path() / "gonio-store-XXXXXX").string();
    const fs::path folder = mkdtemp(pattern.data());
    const fs::path left = folder / ".part-1-1";
    std::ofstream(left) << "of a run that was killed";
    auto first = UploadStore::open(folder, {});
    ASSERT_TRUE(first) << first.error().text();
    EXPECT_FALSE(fs::exists(left));
    auto part = (*first)->begin("a.glb", 0);
    ASSERT_TRUE(part);
    const auto second = UploadStore::open(folder, {});
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, "busy");
    EXPECT_EQ(second.error().where, fs::canonical(folder));
    EXPECT_TRUE(fs::exists(folder / part->temporary_name)) << "it is being written";
    EXPECT_TRUE((*first)->finish(*part));
    EXPECT_TRUE(fs::exists(folder / "a.glb"));
    first->reset();
    EXPECT_TRUE(UploadStore::open(folder, {})) << "free again";
    fs::remove_all(folder);
}

TEST_F(FrontUploadsTest, NeedTheTokenAndTheRightOrigin) {
    options.tokens.all = "0123456789abcdef";
    start_with_uploads();
    EXPECT_EQ(put("a.glb", "x"), 401);
    EXPECT_EQ(put("a.glb", "x", "Authorization: Bearer 0123456789abcdef\r\nOrigin: http://evil.example\r\n"), 403);
    EXPECT_EQ(put("a.glb", "x", "Authorization: Bearer 0123456789abcdef\r\n"), 201);
}

TEST_F(FrontUploadsTest, AViewersTokenLooksAndUploadsNothing) {
    options.tokens = {"0123456789abcdef", "fedcba9876543210"};
    options.limits.auth_failures = 1;
    start_with_uploads();
    const std::string viewer = "Authorization: Bearer fedcba9876543210\r\n",
                      owner = "Authorization: Bearer 0123456789abcdef\r\n";
    EXPECT_EQ(put("a.glb", "x", viewer), 403);
    EXPECT_NE(said.find("permission"), std::string::npos) << said;
    EXPECT_EQ(files(), 0u);
    EXPECT_EQ(put("a.glb", "x", owner), 201) << "it was no wrong guess";
    EXPECT_EQ(put("a.glb", "y", viewer), 403);
    EXPECT_EQ(content("a.glb"), "x");
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/a.glb", viewer, "", "DELETE"), 403);
    EXPECT_EQ(files(), 1u);
    EXPECT_EQ(Client(front->port()).get("/metrics", viewer), 200);
    EXPECT_EQ(Client(front->port()).get("/v1/uploads/a.glb", owner, "", "DELETE"), 200);
}

TEST_F(FrontUploadsTest, APrivateFolderIsDiscardedWhileItIsWritten) {
    start_with_uploads();
    ASSERT_EQ(put("a.glb", "x"), 201);
    Client writing(front->port());
    writing.send("PUT /v1/uploads/b.glb HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nsome");
    ASSERT_TRUE(files_become(2));
    EXPECT_TRUE(store->discard(std::chrono::milliseconds(500)));
    EXPECT_FALSE(fs::exists(store->folder()));
    EXPECT_GE(put("c.glb", "x"), 500) << "nothing comes back";
    EXPECT_FALSE(fs::exists(store->folder()));
}

TEST_F(FrontUploadsTest, ThePrivateFolderGoesWithItsStore) {
    start_with_uploads();
    EXPECT_EQ(put("a.glb", "x"), 201);
    const fs::path folder = store->folder();
    EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
    front.reset();
    store.reset();
    EXPECT_FALSE(fs::exists(folder));
}

TEST_F(FrontUploadsTest, TheCommandLineUploads) {
    start_with_uploads();
    const std::string file = (fs::temp_directory_path() / "gonio-upload-test.glb").string();
    std::ofstream(file) << std::string(200'000, 'y');
    const auto address = parse_server_url("http://127.0.0.1:" + std::to_string(front->port()));
    const auto sent = upload(*address, "", file, "mine.glb");
    EXPECT_TRUE(sent) << sent.error().text();
    EXPECT_EQ(content("mine.glb").size(), 200'000u);
    const auto refused = upload(*address, "", file, "mine.txt");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "refused");
    fs::remove(file);
}

TEST(SceneAccess, OnlyWhatClientsMayLoad) {
    std::string pattern = (fs::temp_directory_path() / "gonio-access-XXXXXX").string();
    const fs::path folder = mkdtemp(pattern.data());
    fs::create_directories(folder / "root/sub");
    fs::create_directories(folder / "uploads");
    for (const char* name : {"root/sub/a.glb", "outside.glb", "uploads/u.glb"}) std::ofstream(folder / name) << "x";
    fs::create_symlink(folder / "outside.glb", folder / "root/link.glb");
    fs::create_symlink(folder / "root", folder / "way");
    const SceneAccess rooted{true, {(folder / "root").string()}, (folder / "uploads").string()};
    EXPECT_EQ(*scene_path(rooted, "cornell"), "cornell");
    EXPECT_EQ(*scene_path(rooted, (folder / "root/sub/a.glb").string()), (folder / "root/sub/a.glb").string());
    EXPECT_EQ(*scene_path(rooted, "sub/a.glb"), (folder / "root/sub/a.glb").string());
    EXPECT_EQ(*scene_path(rooted, (folder / "way/sub/a.glb").string()), (folder / "root/sub/a.glb").string());
    EXPECT_EQ(*scene_path(rooted, "upload:u.glb"), (folder / "uploads/u.glb").string());
    for (const std::string& bad : {(folder / "outside.glb").string(), (folder / "root/link.glb").string(),
                                   (folder / "root/../outside.glb").string(), std::string("../outside.glb"),
                                   std::string("/etc/passwd"), (folder / "missing.glb").string()}) {
        const auto path = scene_path(rooted, bad);
        ASSERT_FALSE(path) << bad;
        EXPECT_EQ(path.error().code, "permission") << "and nothing of whether it is there: " << bad;
    }
    EXPECT_EQ(scene_path(rooted, "upload:../outside.glb").error().code, "invalid_argument");
    EXPECT_EQ(scene_path(rooted, "upload:missing.glb").error().code, "not_found");
    EXPECT_EQ(*scene_path({true, {}, ""}, "/any/where.glb"), "/any/where.glb");
    EXPECT_EQ(scene_path({false, {}, ""}, "/any/where.glb").error().code, "permission");
    EXPECT_EQ(scene_path({true, {}, ""}, "upload:u.glb").error().code, "invalid_argument");
    fs::remove_all(folder);
}

TEST_F(FrontUploadsTest, OnlyWholeFilesReplaceOthers) {
    start_with_uploads();
    ASSERT_EQ(put("a.ies", "whole"), 201);
    const auto status_of = [&](const std::string& headers) {
        Client client(front->port());
        client.send("PUT /v1/uploads/a.ies HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
        return client.read_response();
    };
    EXPECT_EQ(status_of(""), 411);
    EXPECT_EQ(status_of("Transfer-Encoding: gzip\r\n"), 400);
    EXPECT_EQ(put("a.ies", "part", "Content-Range: bytes 5-8/9\r\n"), 400);
    EXPECT_EQ(put("a.ies", "packed", "Content-Encoding: gzip\r\n"), 415);
    EXPECT_EQ(content("a.ies"), "whole");
    EXPECT_TRUE(files_become(1));
}

TEST_F(FrontUploadsTest, FilesBegunTogetherKeepTheLimitToo) {
    options.limits.upload_files = 1;
    start_with_uploads();
    Client first(front->port()), second(front->port());
    const auto begin = [&](Client& client, const std::string& name) {
        client.send("PUT /v1/uploads/" + name + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\n\r\nha");
    };
    begin(first, "a.ies");
    begin(second, "b.ies");
    ASSERT_TRUE(files_become(2)) << "both are being written";
    first.send("lf");
    EXPECT_EQ(first.read_response(), 201);
    second.send("lf");
    EXPECT_EQ(second.read_response(), 507);
    EXPECT_EQ(content("a.ies"), "half");
    EXPECT_TRUE(files_become(1));
}

}  // namespace
}  // namespace gonio
