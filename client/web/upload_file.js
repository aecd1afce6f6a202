// Files that are sent to the server by HTTP, where they have room that messages lack.

const kMostNameBytes = 120;    // that the server takes

// Result: the name under which the server takes the file: its own, shortened where it is too long, without what no name holds.
export function uploadName(name) {
    const at = name.lastIndexOf("."), ending = name.slice(at).toLowerCase(), bytesOf = (text) => new TextEncoder().encode(text).length;
    // Control characters and those that change the direction of writing (protocol/text/text_bytes.h).
    const clean = name.slice(0, at).normalize("NFC").replaceAll(/[\p{Cc}\u2028-\u202E\u2066-\u2069/\\"]/gu, "-").replace(/^[. ]+/, "");
    let letters = [...clean];
    while (bytesOf(letters.join("")) > kMostNameBytes - bytesOf(ending)) letters = letters.slice(0, -1);
    return `${letters.join("") || "file"}${ending}`;
}

// Result: {name}, "upload:NAME" by which the server finds it; or {refused}, as the answer to a command is.
export async function putFile(connection, file) {
    const name = uploadName(file.name), token = connection.token;
    const response = await fetch(`/v1/uploads/${encodeURIComponent(name)}`, {
        method: "PUT", body: file, headers: token ? {Authorization: `Bearer ${token}`} : {},
    }).catch(() => null);
    if (response?.ok) return {name: `upload:${name}`};
    return {refused: {code: "upload", field: "", value: file.name, message: response ? (await response.text()).trim() : "The upload broke off."}};
}
