// The client of `farm-ar serve`, and the paper's method itself for when the service is out of reach.
// One file without Unity types: Unity's frame is the service's own, so poses are sent as Transform has them.
// Bodies are those of docs/headset.md in farm-ar.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Net;
using System.Security.Cryptography;
using System.Text;

namespace FarmAr
{
    using Values = Dictionary<string, object>;

    /// <summary>A thing of a layout, or one that was detected: metres and a quaternion, as its Transform has them.</summary>
    public sealed class Thing
    {
        /// <summary>Its label in a layout; a name of its own in a snapshot.</summary>
        public string Id;
        /// <summary>What it looks like; null if that is not known. Things of one category look alike.</summary>
        public string Category;
        /// <summary>What a tracker calls it, the same in the next snapshot; null for none.</summary>
        public string TrackId;
        public double X, Y, Z;
        /// <summary>x, y, z, w; null if its heading is not known.</summary>
        public double[] Rotation;
        /// <summary>Width, height and depth before turning; null if not known.</summary>
        public double[] Size;
        /// <summary>Whether it never moves; of a layout.</summary>
        public bool Fixed;

        internal Values ToJson(string name)
        {
            var body = new Values { { name, Id }, { "x", X }, { "y", Y }, { "z", Z } };
            if (Rotation != null) body["quaternion"] = Rotation;
            if (Size != null) body["size_whd"] = Size;
            if (Category != null) body["category"] = Category;
            if (TrackId != null) body["track_id"] = TrackId;
            if (Fixed) body["fixed"] = true;
            return body;
        }
    }

    /// <summary>The camera of a snapshot: its pose and what it sees.</summary>
    public sealed class Eye
    {
        public double X, Y, Z;
        /// <summary>x, y, z, w.</summary>
        public double[] Rotation = { 0, 0, 0, 1 };
        /// <summary>To the left and to the right, degrees.</summary>
        public double LeftDeg = 35, RightDeg = 35;
        /// <summary>How far things are detected, metres.</summary>
        public double Range = 3;

        internal Values ToJson()
        {
            return new Values
            {
                { "x", X }, { "y", Y }, { "z", Z }, { "quaternion", Rotation },
                { "fov_left_deg", LeftDeg }, { "fov_right_deg", RightDeg }, { "range_m", Range },
            };
        }
    }

    /// <summary>What a detection is.</summary>
    public sealed class Answer
    {
        public string Detection;
        /// <summary>The label; null for none.</summary>
        public string Id;
        /// <summary>Why there is none.</summary>
        public string Reason;
        /// <summary>NaN where not known, as the next two.</summary>
        public double Confidence = double.NaN;
        public double Margin = double.NaN, Cost = double.NaN;
        /// <summary>Other labels that it may be, the most probable first; null is none of them.</summary>
        public string[] Alternatives = new string[0];
    }

    /// <summary>The answer to a snapshot.</summary>
    public sealed class Reply
    {
        public List<Answer> Answers = new List<Answer>();
        public string[] Missing = new string[0], New = new string[0], Warnings = new string[0];
        /// <summary>Whether it was worked out here, since the service did not answer.</summary>
        public bool Offline;
    }

    /// <summary>The service refused a request.</summary>
    public sealed class FarmArException : Exception
    {
        /// <summary>Of HTTP; 409 where another client has decided something since.</summary>
        public readonly int Status;
        public readonly string Field;

        public FarmArException(int status, string field, string message) : base(message)
        {
            Status = status;
            Field = field;
        }
    }

    /// <summary>A session of the service. Calls block: run them in a Task.</summary>
    public sealed class Session
    {
        public readonly string Url, Name;
        /// <summary>What the service printed, if it printed one.</summary>
        public string Token;
        /// <summary>SHA-256 of its certificate, as it was printed, for https.</summary>
        public string Pin;
        public int TimeoutMs = 5000;

        /// <summary>Makes a request: method, path, body or null; gives status and text. Throws WebException where
        /// nobody answers. May be replaced, say by one with UnityWebRequest.</summary>
        public Func<string, string, string, KeyValuePair<int, string>> Transport;

        long revision, seenAt;
        string snapshot;
        Values layout;
        double[] origin;

        public Session(string url, string name)
        {
            Url = new Uri(url).GetLeftPart(UriPartial.Authority);
            Name = name;
            Transport = Send;
        }

        public long Revision { get { return revision; } }

        /// <summary>Begin with a layout.</summary>
        /// <param name="replace">Whether a session that is there already is replaced.</param>
        /// <param name="room">Width and depth of a room from the origin, or null.</param>
        public void Begin(IEnumerable<Thing> objects, string method = "adaptive", bool replace = false, double[] room = null)
        {
            layout = new Values
            {
                { "frame", "unity" }, { "objects", objects.Select(one => (object)one.ToJson("label")).ToList() },
            };
            if (room != null) layout["size_m"] = room;
            origin = null;
            var body = new Values(layout) { { "method", method } };
            if (replace && Json.List(Ask("GET", "/v1/sessions", null), "sessions").Contains(Name))
                body["revision"] = (double)Json.Whole(Ask("GET", Path("state"), null), "revision");
            revision = Json.Whole(Ask("PUT", Path("layout"), body), "revision");
        }

        /// <summary>Which detection is which. Where the service does not answer, the paper's method answers here.</summary>
        public Reply Identify(Eye camera, IEnumerable<Thing> detections, double? timestamp = null)
        {
            var body = new Values
            {
                { "frame", "unity" }, { "camera", camera.ToJson() },
                { "detections", detections.Select(one => (object)one.ToJson("id")).ToList() },
            };
            if (timestamp != null) body["timestamp"] = timestamp.Value;
            Values said;
            try
            {
                said = Ask("POST", Path("snapshots"), body);
            }
            catch (WebException)
            {
                if (layout == null) throw;
                snapshot = null; // what was seen before is not what is confirmed now
                return new Spatial(layout, origin).Identify(body);
            }
            revision = seenAt = Json.Whole(said, "revision");
            snapshot = (string)said["snapshot"];
            var reply = new Reply
            {
                Missing = Json.Texts(said, "missing"), New = Json.Texts(said, "new"), Warnings = Json.Texts(said, "warnings"),
            };
            foreach (Values one in Json.List(said, "detections"))
                reply.Answers.Add(new Answer
                {
                    Detection = (string)one["detection"], Id = (string)one["id"], Reason = (string)one["reason"],
                    Confidence = Json.Number(one, "confidence"), Margin = Json.Number(one, "margin"),
                    Cost = Json.Number(one, "cost"),
                    Alternatives = Json.List(one, "alternatives").Select(other => (string)((Values)other)["id"]).ToArray(),
                });
            return reply;
        }

        /// <summary>The labels of the service's last answer are right, but for these, by detection.</summary>
        /// <param name="force">Whether a label may go to a detection of another category.</param>
        public void Confirm(IDictionary<string, string> labels = null, bool force = false)
        {
            if (snapshot == null)
                throw new FarmArException(409, "snapshot", "snapshot: must have been answered by the service");
            var wrong = new Values();
            if (labels != null) foreach (var one in labels) wrong[one.Key] = one.Value;
            Decide("confirm", seenAt, new Values { { "snapshot", snapshot }, { "labels", wrong }, { "force", force } });
        }

        /// <summary>Take back the last decision.</summary>
        public void Undo()
        {
            Decide("undo", revision, new Values());
        }

        /// <summary>One pose, say a marker's, is known in this app's frame and in the map's; x, y, z and a rotation each.</summary>
        public bool Align(Thing here, Thing map)
        {
            Func<Thing, Values> pose = one => new Values
            {
                { "x", one.X }, { "y", one.Y }, { "z", one.Z }, { "quaternion", one.Rotation },
            };
            var anchor = new Values { { "here", pose(here) }, { "map", pose(map) } };
            return (bool)Decide("align", revision, new Values { { "frame", "unity" }, { "anchor", anchor } })["aligned"];
        }

        /// <summary>All that is known, as JSON values; the layout here becomes what it says.</summary>
        public Values State()
        {
            var state = Ask("GET", Path("state"), null);
            revision = Json.Whole(state, "revision");
            if (layout == null) return state;
            var objects = new List<object>();
            foreach (Values one in Json.List(state, "objects"))
            {
                var pose = (Values)one["pose"];
                var body = new Values((Values)pose["position"]) { { "label", one["id"] } };
                if (pose["orientation"] != null) body["quaternion"] = Json.Four((Values)pose["orientation"]);
                if (one["category"] != null) body["category"] = one["category"];
                if (one["size"] != null)
                    body["size_whd"] = new[] { "x", "y", "z" }.Select(axis => Json.Number((Values)one["size"], axis)).ToArray();
                objects.Add(body);
            }
            layout["objects"] = objects;
            origin = null;
            if (state["origin"] != null)
            {
                var pose = (Values)state["origin"];
                var place = new Values((Values)pose["position"]) { { "quaternion", Json.Four((Values)pose["orientation"]) } };
                origin = Frames.OnPlane(place, "unity", 1);
            }
            return state;
        }

        string Path(string action)
        {
            return "/v1/sessions/" + Uri.EscapeDataString(Name) + "/" + action;
        }

        Values Decide(string action, long at, Values body)
        {
            body["revision"] = (double)at;
            var reply = Ask("POST", Path(action), body);
            State();
            return reply;
        }

        Values Ask(string method, string path, Values body)
        {
            var answer = Transport(method, path, body == null ? null : Json.Write(body));
            Values values;
            try
            {
                values = (Values)Json.Read(answer.Value);
            }
            catch (Exception)
            {
                throw new FarmArException(answer.Key, "reply", "the reply is not one of farm-ar's service");
            }
            if (answer.Key < 300) return values;
            var error = values.ContainsKey("error") ? (Values)values["error"] : new Values();
            object field, message;
            error.TryGetValue("field", out field);
            error.TryGetValue("message", out message);
            throw new FarmArException(answer.Key, field as string, message as string ?? "status " + answer.Key);
        }

        KeyValuePair<int, string> Send(string method, string path, string body)
        {
            var request = (HttpWebRequest)WebRequest.Create(Url + path);
            request.Method = method;
            request.Timeout = request.ReadWriteTimeout = TimeoutMs;
            request.Proxy = null;
            request.ServicePoint.Expect100Continue = false;
            if (Token != null) request.Headers["Authorization"] = "Bearer " + Token;
            if (Pin != null)
            {
                request.ConnectionGroupName = Pin; // a connection that another pin has let through is not used
                request.ServerCertificateValidationCallback = (sender, certificate, chain, problems) =>
                    Hash(certificate.GetRawCertData()) == Pin.Replace(":", "").ToUpperInvariant();
            }
            if (body != null)
            {
                var bytes = Encoding.UTF8.GetBytes(body);
                request.ContentType = "application/json";
                request.ContentLength = bytes.Length;
                using (var stream = request.GetRequestStream()) stream.Write(bytes, 0, bytes.Length);
            }
            HttpWebResponse reply;
            try
            {
                reply = (HttpWebResponse)request.GetResponse();
            }
            catch (WebException problem)
            {
                reply = problem.Response as HttpWebResponse;
                if (reply == null) throw;
            }
            using (reply)
            using (var reader = new StreamReader(reply.GetResponseStream(), Encoding.UTF8))
                return new KeyValuePair<int, string>((int)reply.StatusCode, reader.ReadToEnd());
        }

        static string Hash(byte[] bytes)
        {
            using (var sha = SHA256.Create()) return string.Concat(sha.ComputeHash(bytes).Select(b => b.ToString("X2")).ToArray());
        }
    }

    /// <summary>The paper's method, without a service: the assignment with the least sum of costs (Eqs. 4 to 8).</summary>
    public sealed class Spatial
    {
        sealed class Known
        {
            public string Name, Category;
            public double[] Pose; // x, z, yaw
            public double[] Sides; // logarithms, sorted; null if not known
        }

        readonly List<Known> labels;
        readonly HashSet<string> categories = new HashSet<string>();
        readonly bool named;
        readonly double perMetre, perTurn;
        readonly double[] origin;

        /// <param name="layout">As it is sent to the service, in any of its frames.</param>
        /// <param name="origin">Of the snapshots' frame in the map: x, z, yaw; or null.</param>
        public Spatial(Values layout, double[] origin = null)
        {
            this.origin = origin;
            labels = Read(layout, "objects", "label");
            if (labels.Count == 0) throw new FarmArException(422, "objects", "objects: must be at least one");
            named = labels.All(one => one.Category != null);
            foreach (var one in labels) if (one.Category != null) categories.Add(one.Category);
            double diagonal, area;
            Extent(layout, out diagonal, out area);
            perMetre = 0.36 * Math.Sqrt(area) / diagonal;
            perTurn = 1;
            if (layout.ContainsKey("weights"))
            {
                var weights = (Values)layout["weights"];
                perMetre = Json.Number(weights, "translation") / diagonal;
                if (weights.ContainsKey("rotation")) perTurn = Json.Number(weights, "rotation");
            }
        }

        /// <param name="snapshot">As it is sent to the service, in any of its frames.</param>
        public Reply Identify(Values snapshot)
        {
            var seen = Read(snapshot, "detections", "id");
            var reply = new Reply { Offline = true };
            var rows = new List<Known>();
            foreach (var one in seen)
            {
                if (!named) one.Category = null;
                if (origin != null) one.Pose = InMap(one.Pose);
                var answer = new Answer { Detection = one.Name };
                if (!Finite(one.Pose[0]) || !Finite(one.Pose[1])) answer.Reason = "its pose is broken";
                else if (one.Category != null && !categories.Contains(one.Category))
                    answer.Reason = "the scene has no '" + one.Category + "'";
                else rows.Add(one);
                reply.Answers.Add(answer);
            }
            var costs = rows.Select(one => labels.Select(label => Cost(one, label)).ToArray()).ToArray();
            var given = Assign(costs, labels.Count);
            int row = 0;
            foreach (var answer in reply.Answers)
            {
                if (answer.Reason != null) continue;
                int j = given[row];
                if (j < 0) answer.Reason = "all labels that it may have are given to others";
                else
                {
                    answer.Id = labels[j].Name;
                    answer.Cost = costs[row][j];
                }
                row++;
            }
            return reply;
        }

        double[] InMap(double[] pose)
        {
            double s = Math.Sin(origin[2]), c = Math.Cos(origin[2]);
            return new[]
            {
                origin[0] + c * pose[0] + s * pose[1], origin[1] - s * pose[0] + c * pose[1], pose[2] + origin[2],
            };
        }

        /// Infinite where the categories differ.
        double Cost(Known seen, Known label)
        {
            if (seen.Category != null && seen.Category != label.Category) return double.PositiveInfinity;
            double dx = seen.Pose[0] - label.Pose[0], dz = seen.Pose[1] - label.Pose[1];
            double turn = perTurn * Math.Abs(Math.Sin((seen.Pose[2] - label.Pose[2]) / 2));
            double cost = perMetre * Math.Sqrt(dx * dx + dz * dz) + (double.IsNaN(turn) ? 0 : turn);
            if (seen.Sides == null || label.Sides == null) return cost;
            double gap = 0;
            for (int k = 0; k < 3; k++) gap += Math.Abs(seen.Sides[k] - label.Sides[k]);
            return Math.Exp(gap) * cost;
        }

        static List<Known> Read(Values body, string list, string name)
        {
            string frame = (string)body["frame"];
            double metres = Frames.Metres(body);
            var found = new List<Known>();
            foreach (Values one in Json.List(body, list))
            {
                object id, category, size;
                one.TryGetValue(name, out id);
                one.TryGetValue("category", out category);
                one.TryGetValue("size_whd", out size);
                double[] sides = null;
                if (size != null)
                {
                    sides = Json.Numbers(size).Select(side => Math.Log(side * metres)).ToArray();
                    Array.Sort(sides);
                }
                found.Add(new Known
                {
                    Name = (string)id ?? found.Count.ToString(CultureInfo.InvariantCulture),
                    Category = (string)category, Pose = Frames.OnPlane(one, frame, metres), Sides = sides,
                });
            }
            return found;
        }

        /// The diagonal (the l of Eq. 4) and the area of a layout, metres.
        void Extent(Values layout, out double diagonal, out double area)
        {
            double metres = Frames.Metres(layout);
            object bounds, sides = null;
            layout.TryGetValue("bounds", out bounds);
            foreach (var body in new[] { layout, bounds as Values })
                foreach (var name in new[] { "size_m", "size" })
                    if (body != null && sides == null) body.TryGetValue(name, out sides);
            if (sides != null)
            {
                var wd = Json.Numbers(sides).Select(side => side * metres).ToArray();
                diagonal = Math.Sqrt(wd[0] * wd[0] + wd[1] * wd[1]);
                area = wd[0] * wd[1];
                return;
            }
            if (bounds != null)
            {
                var corners = ((System.Collections.IEnumerable)bounds).Cast<object>()
                    .Select(one => Json.Numbers(one).Select(v => v * metres).ToArray()).ToList();
                double twice = 0;
                for (int i = 0; i < corners.Count; i++)
                {
                    var next = corners[(i + 1) % corners.Count];
                    twice += corners[i][0] * next[1] - corners[i][1] * next[0];
                }
                diagonal = Farthest(corners);
                area = Math.Abs(twice) / 2;
                return;
            }
            diagonal = Farthest(labels.Select(one => one.Pose).ToList());
            if (diagonal == 0)
                foreach (Values one in Json.List(layout, "objects"))
                    if (one.ContainsKey("size_whd"))
                    {
                        var size = Json.Numbers(one["size_whd"]);
                        diagonal = Math.Max(diagonal, metres * Math.Sqrt(size[0] * size[0] + size[2] * size[2]));
                    }
            if (diagonal == 0) diagonal = 1;
            area = diagonal * diagonal / 2;
        }

        static double Farthest(List<double[]> points)
        {
            double most = 0;
            foreach (var a in points)
                foreach (var b in points)
                    most = Math.Max(most, Math.Sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])));
            return most;
        }

        static bool Finite(double value)
        {
            return !double.IsNaN(value) && !double.IsInfinity(value);
        }

        /// <summary>The cheapest assignment of columns to rows that leaves as few rows as possible without one: the
        /// Hungarian algorithm. Infinite costs are no pairs; a row without a column gets -1.</summary>
        public static int[] Assign(double[][] costs, int m)
        {
            int n = costs.Length, width = m + n;
            double dearest = 0;
            foreach (var line in costs) foreach (var value in line) if (Finite(value)) dearest = Math.Max(dearest, value);
            double none = (n + 1) * (dearest + 1), never = (n + 1) * none; // none is dearer than any rearrangement
            var u = new double[n + 1];
            var v = new double[width + 1];
            var row = new int[width + 1];
            for (int i = 1; i <= n; i++)
            {
                row[0] = i;
                var least = Enumerable.Repeat(double.PositiveInfinity, width + 1).ToArray();
                var way = new int[width + 1];
                var done = new bool[width + 1];
                int j0 = 0;
                do
                {
                    done[j0] = true;
                    double delta = double.PositiveInfinity;
                    int next = 0, at = row[j0] - 1;
                    for (int j = 1; j <= width; j++)
                    {
                        if (done[j]) continue;
                        double cost = j > m ? (j - m - 1 == at ? none : never) : Finite(costs[at][j - 1]) ? costs[at][j - 1] : never;
                        double reduced = cost - u[row[j0]] - v[j];
                        if (reduced < least[j])
                        {
                            least[j] = reduced;
                            way[j] = j0;
                        }
                        if (least[j] < delta)
                        {
                            delta = least[j];
                            next = j;
                        }
                    }
                    for (int j = 0; j <= width; j++)
                    {
                        if (done[j])
                        {
                            u[row[j]] += delta;
                            v[j] -= delta;
                        }
                        else least[j] -= delta;
                    }
                    j0 = next;
                } while (row[j0] != 0);
                while (j0 != 0)
                {
                    row[j0] = row[way[j0]];
                    j0 = way[j0];
                }
            }
            var given = Enumerable.Repeat(-1, n).ToArray();
            for (int j = 1; j <= m; j++) if (row[j] != 0) given[row[j] - 1] = j - 1;
            return given;
        }
    }

    /// <summary>Poses of the service's frames on the plane of Unity's.</summary>
    public static class Frames
    {
        static readonly Values Units = new Values
        {
            { "m", 1.0 }, { "cm", 0.01 }, { "mm", 0.001 }, { "km", 1000.0 }, { "in", 0.0254 }, { "ft", 0.3048 }, { "yd", 0.9144 },
        };

        /// <summary>Metres in the unit of a body.</summary>
        public static double Metres(Values body)
        {
            return body.ContainsKey("units") ? (double)Units[(string)body["units"]] : 1.0;
        }

        /// <summary>x, z and yaw (radians, clockwise from above, 0 along +z, NaN where not known) of a pose in any form.</summary>
        public static double[] OnPlane(Values pose, string frame, double metres)
        {
            double[][] matrix = null;
            object given;
            double x, y, z;
            if (pose.TryGetValue("matrix", out given))
            {
                matrix = ((System.Collections.IEnumerable)given).Cast<object>().Select(Json.Numbers).ToArray();
                x = matrix[0][3];
                y = matrix[1][3];
                z = matrix[2][3];
            }
            else
            {
                x = Json.Number(pose, "x");
                y = Json.Number(pose, "y");
                z = Json.Number(pose, "z");
            }
            var place = frame == "ros" ? new[] { -y * metres, x * metres } : new[] { x * metres, (frame == "openxr" ? -z : z) * metres };
            double yaw = double.NaN, sense = frame == "unity" ? 1 : -1;
            if (pose.ContainsKey("yaw_rad")) yaw = sense * Json.Number(pose, "yaw_rad");
            else if (pose.ContainsKey("yaw_deg")) yaw = sense * Json.Number(pose, "yaw_deg") * Math.PI / 180;
            else if (pose.TryGetValue("quaternion", out given)) yaw = Heading(Rotation(Json.Numbers(given)), frame);
            else if (matrix != null) yaw = Heading(matrix, frame);
            return new[] { place[0], place[1], yaw };
        }

        static double[][] Rotation(double[] q)
        {
            double length = Math.Sqrt(q.Sum(part => part * part));
            if (!(Math.Abs(length - 1) <= 0.01)) throw new FarmArException(422, "quaternion", "quaternion: must be unit");
            double x = q[0] / length, y = q[1] / length, z = q[2] / length, w = q[3] / length;
            return new[]
            {
                new[] { 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w) },
                new[] { 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w) },
                new[] { 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y) },
            };
        }

        /// Where the forward of a body points; if that is up or down, by its right-hand side.
        static double Heading(double[][] r, string frame)
        {
            var forward = Turned(r, frame, frame == "ros" ? new[] { 1.0, 0, 0 } : new[] { 0, 0, frame == "openxr" ? -1.0 : 1.0 });
            if (Math.Sqrt(forward[0] * forward[0] + forward[1] * forward[1]) > 1e-9) return Math.Atan2(forward[0], forward[1]);
            var right = Turned(r, frame, frame == "ros" ? new[] { 0, -1.0, 0 } : new[] { 1.0, 0, 0 });
            return Math.Atan2(-right[1], right[0]);
        }

        static double[] Turned(double[][] r, string frame, double[] v)
        {
            var t = new double[3];
            for (int i = 0; i < 3; i++) t[i] = r[i][0] * v[0] + r[i][1] * v[1] + r[i][2] * v[2];
            return frame == "ros" ? new[] { -t[1], t[0] } : new[] { t[0], frame == "openxr" ? -t[2] : t[2] };
        }
    }

    /// <summary>JSON, as much of it as bodies need: objects are dictionaries, lists List&lt;object&gt;, numbers double.</summary>
    public static class Json
    {
        public static string Write(object value)
        {
            var text = new StringBuilder();
            Write(text, value);
            return text.ToString();
        }

        static void Write(StringBuilder text, object value)
        {
            if (value == null) text.Append("null");
            else if (value is bool) text.Append((bool)value ? "true" : "false");
            else if (value is string) Quote(text, (string)value);
            else if (value is double)
            {
                double number = (double)value; // JSON has no NaN: what is not a number is not known
                bool finite = !double.IsNaN(number) && !double.IsInfinity(number);
                text.Append(finite ? number.ToString("R", CultureInfo.InvariantCulture) : "null");
            }
            else if (value is Values)
            {
                string between = "{";
                foreach (var pair in (Values)value)
                {
                    text.Append(between);
                    Quote(text, pair.Key);
                    text.Append(':');
                    Write(text, pair.Value);
                    between = ",";
                }
                text.Append(between == "{" ? "{}" : "}");
            }
            else
            {
                string between = "[";
                foreach (var item in (System.Collections.IEnumerable)value)
                {
                    text.Append(between);
                    Write(text, item);
                    between = ",";
                }
                text.Append(between == "[" ? "[]" : "]");
            }
        }

        static void Quote(StringBuilder text, string value)
        {
            text.Append('"');
            foreach (char c in value)
            {
                if (c == '"' || c == '\\') text.Append('\\').Append(c);
                else if (c < ' ') text.Append("\\u").Append(((int)c).ToString("x4"));
                else text.Append(c);
            }
            text.Append('"');
        }

        public static object Read(string text)
        {
            int at = 0;
            var value = Read(text, ref at);
            Space(text, ref at);
            if (at != text.Length) throw new FormatException("more than one JSON value");
            return value;
        }

        static object Read(string text, ref int at)
        {
            Space(text, ref at);
            char first = text[at];
            if (first == '"') return Text(text, ref at);
            if (first == '{')
            {
                var values = new Values();
                at++;
                for (Space(text, ref at); text[at] != '}'; Space(text, ref at))
                {
                    if (text[at] == ',') at++;
                    Space(text, ref at);
                    string name = Text(text, ref at);
                    Space(text, ref at);
                    if (text[at++] != ':') throw new FormatException("a colon is missing");
                    values[name] = Read(text, ref at);
                }
                at++;
                return values;
            }
            if (first == '[')
            {
                var items = new List<object>();
                at++;
                for (Space(text, ref at); text[at] != ']'; Space(text, ref at))
                {
                    if (text[at] == ',') at++;
                    items.Add(Read(text, ref at));
                }
                at++;
                return items;
            }
            int begin = at;
            while (at < text.Length && ",]} \t\r\n".IndexOf(text[at]) < 0) at++;
            string word = text.Substring(begin, at - begin);
            if (word == "null") return null;
            if (word == "true" || word == "false") return word == "true";
            return double.Parse(word, NumberStyles.Float, CultureInfo.InvariantCulture);
        }

        static string Text(string text, ref int at)
        {
            var found = new StringBuilder();
            if (text[at++] != '"') throw new FormatException("a string is missing");
            while (text[at] != '"')
            {
                if (text[at] != '\\')
                {
                    found.Append(text[at++]);
                    continue;
                }
                char code = text[at + 1];
                at += 2;
                if (code == 'u')
                {
                    found.Append((char)int.Parse(text.Substring(at, 4), NumberStyles.HexNumber, CultureInfo.InvariantCulture));
                    at += 4;
                }
                else found.Append(code == 'n' ? '\n' : code == 't' ? '\t' : code == 'r' ? '\r' : code == 'b' ? '\b' : code == 'f' ? '\f' : code);
            }
            at++;
            return found.ToString();
        }

        static void Space(string text, ref int at)
        {
            while (at < text.Length && char.IsWhiteSpace(text[at])) at++;
        }

        internal static List<object> List(Values body, string name)
        {
            return (List<object>)body[name];
        }

        internal static string[] Texts(Values body, string name)
        {
            return List(body, name).Cast<string>().ToArray();
        }

        internal static double Number(Values body, string name)
        {
            object value;
            return body.TryGetValue(name, out value) && value is double ? (double)value : double.NaN;
        }

        internal static long Whole(Values body, string name)
        {
            return (long)(double)body[name];
        }

        internal static double[] Numbers(object list)
        {
            return list as double[] ?? ((List<object>)list).Select(one => one is double ? (double)one : double.NaN).ToArray();
        }

        internal static double[] Four(Values turn)
        {
            return new[] { "x", "y", "z", "w" }.Select(axis => Number(turn, axis)).ToArray();
        }
    }
}
