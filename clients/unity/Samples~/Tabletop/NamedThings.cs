// Names over identical things. Put it on an object of the scene, give it the service's address and the things.
// With AR Foundation, let ARTrackedImageManager or ARTrackedObjectManager fill `things` with what is tracked.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading.Tasks;
using FarmAr;
using UnityEngine;

public sealed class NamedThings : MonoBehaviour
{
    [Serializable]
    public sealed class Kind
    {
        public string category;
        public List<Transform> things = new List<Transform>();
        public Vector3 size = new Vector3(0.1f, 0.1f, 0.1f);
    }

    [Tooltip("As farm-ar serve prints it")] public string url = "http://127.0.0.1:8765";
    public string token = "";
    [Tooltip("SHA-256 of the certificate, for https")] public string pin = "";
    public List<Kind> kinds = new List<Kind>();
    public Camera eye;

    readonly Dictionary<Transform, string> names = new Dictionary<Transform, string>();
    Session session;
    string said = "Name what is here.";
    bool busy;

    void Awake()
    {
        session = new Session(url, "unity")
        {
            Token = token == "" ? null : token, Pin = pin == "" ? null : pin,
        };
        if (eye == null) eye = Camera.main;
    }

    /// The things as they are now: this is Unity's frame, which the service has, too.
    List<KeyValuePair<Transform, Thing>> Seen()
    {
        var seen = new List<KeyValuePair<Transform, Thing>>();
        foreach (var kind in kinds)
            foreach (var one in kind.things.Where(one => one != null && one.gameObject.activeInHierarchy))
            {
                var p = one.position;
                var r = one.rotation;
                seen.Add(new KeyValuePair<Transform, Thing>(one, new Thing
                {
                    Id = seen.Count.ToString(), Category = kind.category, X = p.x, Y = p.y, Z = p.z,
                    Rotation = new double[] { r.x, r.y, r.z, r.w },
                    Size = new double[] { kind.size.x, kind.size.y, kind.size.z },
                }));
            }
        return seen;
    }

    async void Do(Func<string> work)
    {
        busy = true;
        try
        {
            said = await Task.Run(work);
        }
        catch (Exception problem)
        {
            said = problem.Message;
        }
        busy = false;
    }

    void Begin()
    {
        var seen = Seen();
        var count = new Dictionary<string, int>();
        names.Clear();
        foreach (var one in seen)
        {
            int number;
            count.TryGetValue(one.Value.Category, out number);
            count[one.Value.Category] = ++number;
            names[one.Key] = one.Value.Id = one.Value.Category + " " + number;
        }
        Do(() =>
        {
            session.Begin(seen.Select(one => one.Value), replace: true);
            return "Move some things, then look again.";
        });
    }

    void Look()
    {
        var seen = Seen();
        var t = eye.transform;
        float half = Mathf.Atan(Mathf.Tan(eye.fieldOfView * Mathf.Deg2Rad / 2) * eye.aspect) * Mathf.Rad2Deg;
        var camera = new Eye
        {
            X = t.position.x, Y = t.position.y, Z = t.position.z, LeftDeg = half, RightDeg = half, Range = eye.farClipPlane,
            Rotation = new double[] { t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w },
        };
        double now = Time.timeAsDouble;
        Do(() =>
        {
            var reply = session.Identify(camera, seen.Select(one => one.Value), now);
            lock (names)
            {
                names.Clear();
                for (int i = 0; i < seen.Count; i++) names[seen[i].Key] = reply.Answers[i].Id ?? "?";
            }
            return (reply.Offline ? "The service is out of reach, named here. " : "") + string.Join(" ", reply.Warnings);
        });
    }

    void OnGUI()
    {
        GUILayout.Label(said);
        GUI.enabled = !busy;
        if (GUILayout.Button("Name what is here")) Begin();
        if (GUILayout.Button("Look again")) Look();
        if (GUILayout.Button("All right")) Do(() => { session.Confirm(); return "Kept."; });
        if (GUILayout.Button("Undo")) Do(() => { session.Undo(); return "Undone."; });
        lock (names)
            foreach (var one in names)
            {
                if (one.Key == null) continue;
                var at = eye.WorldToScreenPoint(one.Key.position);
                if (at.z > 0) GUI.Label(new Rect(at.x - 50, Screen.height - at.y - 20, 100, 20), one.Value);
            }
    }
}
