// Prints the points of a .las file as npm's copc reads them, one a line: x y z, GPS time, and the
// extra bytes. It stands beside copc's node_modules when it runs.
import copc from 'copc'
import { readFileSync } from 'fs'

const { Las } = copc
const bytes = readFileSync(process.argv[2])
const get = async (begin, end) => bytes.subarray(begin, end)
const header = Las.Header.parse(bytes)
const records = await Las.Vlr.walk(get, header)
const described = await Las.Vlr.fetch(get, Las.Vlr.find(records, 'LASF_Spec', 4))
const extraBytes = Las.ExtraBytes.parse(described)
const view = Las.View.create(bytes.subarray(header.pointDataOffset), header, extraBytes)
const getters = ['X', 'Y', 'Z', 'GpsTime', ...extraBytes.map((extra) => extra.name)].map(view.getter)
for (let i = 0; i < header.pointCount; ++i) {
  console.log(getters.map((get) => get(i)).join(' '))
}
